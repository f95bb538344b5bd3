//! The support of a friction cone with unit normal force, hard (`gamma = 0`) or soft, in its contact frame.

use crate::grasp::contact::ContactForce;

