//! The arm's own dimensions, as measured by its maker.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use devices::{ARM_JOINTS, ArmError};
use kinematics::ModifiedDh;

use crate::units::metres;

/// Arms differ from the nominal one by less, metres: some 10 mm were seen at the tool.
const MOST_METRES: f64 = 0.020;
/// The same of turns, radians.
const MOST_RADIANS: f64 = 0.05;

/// alpha (rad), a (m), d (m) of the maker's nominal xArm7; theta is 0.
const NOMINAL: [(f64, f64, f64); ARM_JOINTS] = [
    (0.0, 0.0, 0.267),
    (-FRAC_PI_2, 0.0, 0.0),
    (FRAC_PI_2, 0.0, 0.293),
    (FRAC_PI_2, 0.0525, 0.0),
    (FRAC_PI_2, 0.0775, 0.3425),
    (FRAC_PI_2, 0.0, 0.0),
    (-FRAC_PI_2, 0.076, 0.097),
];

/// From the register's 28 numbers: theta, d, alpha, a of each joint, millimetres and radians. They are refused when they
/// are not close to the nominal arm's: another order of the numbers, other units or another kind of arm is no calibration.
pub(crate) fn modified_dh(numbers: &[f32; 4 * ARM_JOINTS]) -> Result<[ModifiedDh; ARM_JOINTS], ArmError> {
    let mut rows = [ModifiedDh {
        theta: 0.0,
        d: 0.0,
        alpha: 0.0,
        a: 0.0,
    }; ARM_JOINTS];
    let (joints, _) = numbers.as_chunks::<4>();
    for (joint, (row, [theta, d, alpha, a])) in rows.iter_mut().zip(joints).enumerate() {
        *row = ModifiedDh {
            theta: f64::from(*theta),
            d: metres(*d),
            alpha: f64::from(*alpha),
            a: metres(*a),
        };
        check(joint, row)?;
    }
    Ok(rows)
}

fn check(joint: usize, row: &ModifiedDh) -> Result<(), ArmError> {
    let (alpha, a, d) = NOMINAL[joint];
    let differences = [
        ("theta", row.theta, 0.0, turn(row.theta), MOST_RADIANS, "rad"),
        ("d", row.d, d, row.d - d, MOST_METRES, "m"),
        ("alpha", row.alpha, alpha, turn(row.alpha - alpha), MOST_RADIANS, "rad"),
        ("a", row.a, a, row.a - a, MOST_METRES, "m"),
    ];
    for (what, found, nominal, difference, most, unit) in differences {
        if difference.is_nan() || difference.abs() > most {
            return Err(ArmError::Refused {
                reason: format!(
                    "the calibrated {what} of joint {} is {found:.4} {unit}, allowed is {nominal:.4} within {most} {unit}",
                    joint + 1
                ),
            });
        }
    }
    Ok(())
}

/// The same turn, from -pi to pi.
fn turn(angle: f64) -> f64 {
    (angle + PI).rem_euclid(TAU) - PI
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wire() -> [f32; 28] {
        let mut numbers = [0.0; 28];
        for (joint, (alpha, a, d)) in numbers.as_chunks_mut::<4>().0.iter_mut().zip(NOMINAL) {
            *joint = [0.0, d * 1000.0, alpha, a * 1000.0].map(|number| number as f32);
        }
        numbers
    }

    #[test]
    fn a_calibrated_arm_is_close_to_the_nominal_one() {
        let mut numbers = wire();
        numbers[2 * 4 + 1] += 4.5;
        numbers[3 * 4] = -0.01 + std::f32::consts::TAU;
        let rows = modified_dh(&numbers).expect("it is close");
        assert!((rows[2].d - 0.2975).abs() < 1e-6);
        assert!((rows[0].d - 0.267).abs() < 1e-6 && rows[6].alpha < -1.5);
    }

    #[test]
    fn what_is_no_xarm7_names_the_joint() {
        let mut numbers = wire();
        numbers[5 * 4 + 2] += 0.06;
        let text = modified_dh(&numbers).expect_err("it is far off").to_string();
        assert_eq!(
            text,
            "the calibrated alpha of joint 6 is 1.6308 rad, allowed is 1.5708 within 0.05 rad"
        );
        for (place, value) in [(1, 0.267), (4, f32::NAN), (27, f32::INFINITY)] {
            let mut numbers = wire();
            numbers[place] = value;
            assert!(modified_dh(&numbers).is_err(), "{place}");
        }
    }
}
