//! Wrenches, and the map from a contact's force to its wrench (Eq. 8).

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Sizes whose squares neither overflow nor vanish.
pub(crate) const REPRESENTABLE: std::ops::Range<f64> = 1e-140..1e140;

/// A wrench: planar for `D = 3`, spatial for `D = 6`.
pub type Wrench<const D: usize> = SVector<f64, D>;

/// The map `G_i` from `[f_n, f_o, f_t, torsion]` in the contact frame to the wrench; columns that a contact
/// cannot use are zero.
pub type ContactMap<const D: usize> = SMatrix<f64, D, 4>;

/// The Euclidean length, also of a wrench whose squares underflow.
pub(crate) fn length<const D: usize>(wrench: &Wrench<D>) -> f64 {
    let plain = wrench.norm();
    let largest = wrench.amax();
    if plain > REPRESENTABLE.start || largest == 0.0 {
        return plain;
    }
    largest * (wrench / largest).norm()
}

/// The unit vector along a wrench that is not zero. Scaled before its length is taken: the square of a component may
/// not be representable.
pub(crate) fn unit<const D: usize>(wrench: &Wrench<D>) -> Wrench<D> {
    (wrench / wrench.amax()).normalize()
}

/// The wrench `[f, (r - origin) x f]` of a force in world axes; its planar part for `D = 3`.
pub fn wrench_of_force<const D: usize>(lever: &Vector3<f64>, force: &Vector3<f64>) -> Wrench<D> {
    with_torque(force, &lever.cross(force))
}

/// The wrench of a force and a torque; its planar part for `D = 3`.
pub(crate) fn with_torque<const D: usize>(force: &Vector3<f64>, torque: &Vector3<f64>) -> Wrench<D> {
    if D == 3 {
        return Wrench::from_iterator([force.x, force.y, torque.z]);
    }
    Wrench::from_iterator(force.iter().chain(torque.iter()).copied())
}

/// The map `G_i` of a contact at `lever` from the torque origin.
pub(crate) fn contact_map<const D: usize>(lever: &Vector3<f64>, frame: &Matrix3<f64>) -> ContactMap<D> {
    let mut map = ContactMap::<D>::zeros();
    for (column, axis) in frame.column_iter().enumerate() {
        if D == 3 && column == 1 {
            continue;
        }
        map.set_column(column, &wrench_of_force::<D>(lever, &axis.into()));
    }
    if D == 6 {
        map.set_column(3, &with_torque(&Vector3::zeros(), &frame.column(0).into()));
    }
    map
}

/// The force and torque parts of a wrench, or of a functional on wrenches, in space: the inverse of [`with_torque`].
pub(crate) fn split<const D: usize>(z: &Wrench<D>) -> (Vector3<f64>, Vector3<f64>) {
    match D {
        3 => (Vector3::new(z[0], z[1], 0.0), Vector3::new(0.0, 0.0, z[2])),
        _ => (Vector3::new(z[0], z[1], z[2]), Vector3::new(z[3], z[4], z[5])),
    }
}
