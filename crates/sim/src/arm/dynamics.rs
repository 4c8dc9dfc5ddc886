//! What the joints have to hold against gravity.

use geometry::nalgebra::{Point3, Vector3};

use super::model::{ArmModel, Joints};

/// Links 1 to 7: mass (kg) and its centre in the link's frame (m), as the vendor's description gives them.
const LINKS: [(f64, [f64; 3]); 7] = [
    (2.382, [-0.0002, 0.02905, -0.01233]),
    (1.869, [0.00022, -0.12856, 0.01735]),
    (1.638, [0.0466, -0.02463, -0.00768]),
    (1.727, [0.07047, -0.11575, 0.012]),
    (1.320, [-0.00032, 0.01604, -0.026]),
    (1.325, [0.06469, 0.03278, 0.02141]),
    (0.170, [0.0, -0.00677, -0.01098]),
];
const GRAVITY: f64 = 9.80665;

/// A mass on the flange: kilograms, centre in the flange's frame (m).
pub(super) type Load = (f64, [f64; 3]);

/// Newton metres about each joint's axis that hold the arm still. `down` is a unit vector, base frame.
pub(super) fn holding_torques(model: &ArmModel, angles: &Joints, loads: &[Load], down: &Vector3<f64>) -> Joints {
    let frames = model.links(angles);
    let links = LINKS
        .iter()
        .enumerate()
        .map(|(link, (mass, centre))| (link, *mass, *centre));
    let loads = loads.iter().map(|(mass, centre)| (6, *mass, *centre));
    let mut torques = [0.0; 7];
    for (link, mass, centre) in links.chain(loads) {
        let place = frames[link].transform_point(&Point3::from(centre));
        let weight = down * (mass * GRAVITY);
        for (torque, frame) in torques.iter_mut().zip(&frames).take(link + 1) {
            let axis = frame.transform_direction(&Vector3::z());
            *torque -= axis.dot(&(place.coords - frame.translation()).cross(&weight));
        }
    }
    torques
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::config::ArmConfig;

    #[test]
    fn torques_are_the_slope_of_the_potential_energy() {
        let model = ArmModel::new(&ArmConfig::default()).expect("the nominal arm");
        let angles = [0.5, -0.6, 0.3, 1.2, -0.4, 1.6, 0.9];
        let load = (1.3, [0.01, 0.02, 0.15]);
        let energy = |angles: &Joints| -> f64 {
            let frames = model.links(angles);
            let height = |link: usize, centre: [f64; 3]| frames[link].transform_point(&Point3::from(centre)).z;
            let links = LINKS
                .iter()
                .enumerate()
                .map(|(link, (mass, centre))| mass * height(link, *centre));
            GRAVITY * (links.sum::<f64>() + load.0 * height(6, load.1))
        };
        let torques = holding_torques(&model, &angles, &[load], &-Vector3::z());
        for joint in 0..7 {
            let [mut less, mut more] = [angles; 2];
            less[joint] -= 1e-5;
            more[joint] += 1e-5;
            let slope = (energy(&more) - energy(&less)) / 2e-5;
            assert!(
                (torques[joint] - slope).abs() < 1e-6,
                "joint {joint}: {} and {slope}",
                torques[joint]
            );
        }
    }
}
