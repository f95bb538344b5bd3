//! Contacts, frames, wrenches and torque limits.

mod joint_torques;
