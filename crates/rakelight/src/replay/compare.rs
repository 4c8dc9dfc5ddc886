//! How far new results are from recorded ones.

use geometry::nalgebra::Vector3;
use imaging::Image;
use interfaces::geometry_msgs::msg::{Point, Vector3 as Vector3Message};
use interfaces::rakelight_msgs::msg::{Grasp, GraspArray};
use serde::Serialize;

/// Mean angle between normals that still counts as equal, degrees.
const NORMAL_ANGLE: f64 = 0.1;
/// Share of the measured pixels that may be measured in one of both only.
const LONE_PIXELS: f64 = 0.01;
/// Distance of contacts, metres.
const CONTACT: f64 = 0.0005;
/// Angle between grasps' normals, degrees.
const GRASP_ANGLE: f64 = 0.5;
const SCORE: f64 = 0.01;
/// Contacts that are farther apart than this are two grasps, metres.
const SAME_GRASP: f64 = 0.005;

/// Two normal maps.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Normals {
    /// Bit by bit.
    pub(super) same: bool,
    /// Where both measure, degrees; 0 when they nowhere do.
    pub(super) mean_angle: f64,
    /// Share of the pixels that either measures, 0 to 1.
    pub(super) lone_share: f64,
    pub(super) within_tolerance: bool,
}

/// None when the maps have different sizes.
pub(super) fn normals(recorded: &Image<[f32; 3]>, new: &Image<[f32; 3]>) -> Option<Normals> {
    if (recorded.width(), recorded.height()) != (new.width(), new.height()) {
        return None;
    }
    let (mut sum, mut both, mut lone) = (0.0, 0_usize, 0_usize);
    for (old, new) in recorded.pixels().iter().zip(new.pixels()) {
        match (old[0].is_finite(), new[0].is_finite()) {
            (true, true) => {
                let [old, new] = [old, new].map(|normal| Vector3::from(normal.map(f64::from)));
                sum += old.angle(&new);
                both += 1;
            }
            (false, false) => {}
            _ => lone += 1,
        }
    }
    let mean_angle = (sum / both.max(1) as f64).to_degrees();
    let lone_share = lone as f64 / (both + lone).max(1) as f64;
    Some(Normals {
        same: recorded.as_bytes() == new.as_bytes(),
        mean_angle,
        lone_share,
        within_tolerance: mean_angle <= NORMAL_ANGLE && lone_share <= LONE_PIXELS,
    })
}

/// Two plans on one capture.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Grasps {
    /// Bit by bit, poses, joints and reasons included.
    pub(super) same: bool,
    pub(super) recorded: usize,
    pub(super) new: usize,
    /// Found again within 5 mm.
    pub(super) paired: usize,
    /// Largest of the paired, millimetres.
    pub(super) contact_mm: f64,
    /// Largest of the paired, degrees.
    pub(super) angle: f64,
    /// Largest of the paired.
    pub(super) score: f64,
    /// Those that are paired come in the same order.
    pub(super) same_order: bool,
    pub(super) within_tolerance: bool,
}

pub(super) fn grasps(recorded: &GraspArray, new: &GraspArray) -> Grasps {
    let pairs = pairs(&recorded.grasps, &new.grasps);
    let most = |value: fn(&Grasp, &Grasp) -> f64| {
        let values = pairs
            .iter()
            .map(|&(old, found)| value(&recorded.grasps[old], &new.grasps[found]));
        values.fold(0.0, f64::max)
    };
    let (contact, angle) = (most(distance), most(angle).to_degrees());
    let score = most(|a, b| f64::from(a.score - b.score).abs());
    let is_whole = pairs.len() == recorded.grasps.len() && pairs.len() == new.grasps.len();
    let has_same_best = pairs.first().is_none_or(|first| *first == (0, 0));
    Grasps {
        same: recorded == new,
        recorded: recorded.grasps.len(),
        new: new.grasps.len(),
        paired: pairs.len(),
        contact_mm: contact * 1e3,
        angle,
        score,
        same_order: pairs.is_sorted_by_key(|(_, found)| *found),
        within_tolerance: is_whole && has_same_best && contact <= CONTACT && angle <= GRASP_ANGLE && score <= SCORE,
    }
}

/// Each recorded grasp, by rank, with the nearest new one that is left.
fn pairs(recorded: &[Grasp], new: &[Grasp]) -> Vec<(usize, usize)> {
    let mut left: Vec<usize> = (0..new.len()).collect();
    let mut pairs = Vec::new();
    for (rank, grasp) in recorded.iter().enumerate() {
        let apart = |at: usize| distance(grasp, &new[at]);
        let nearest = left.iter().copied().min_by(|a, b| apart(*a).total_cmp(&apart(*b)));
        if let Some(found) = nearest.filter(|found| apart(*found) <= SAME_GRASP) {
            left.retain(|at| *at != found);
            pairs.push((rank, found));
        }
    }
    pairs
}

fn distance(a: &Grasp, b: &Grasp) -> f64 {
    let at = |point: &Point| Vector3::new(point.x, point.y, point.z);
    (at(&a.contact) - at(&b.contact)).norm()
}

fn angle(a: &Grasp, b: &Grasp) -> f64 {
    let along = |vector: &Vector3Message| Vector3::new(vector.x, vector.y, vector.z);
    along(&a.normal).angle(&along(&b.normal))
}

/// What within tolerance means, for people.
pub(super) fn tolerance() -> String {
    format!(
        "normals {NORMAL_ANGLE} degrees in the mean and {} % of the pixels; grasps {} mm, {GRASP_ANGLE} degrees, score \
         {SCORE}, none missing or new, the same best",
        1e2 * LONE_PIXELS,
        1e3 * CONTACT
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grasp(x: f64, score: f32) -> Grasp {
        Grasp {
            contact: Point { x, y: 0.1, z: 0.03 },
            normal: Vector3Message { x: 0.0, y: 0.0, z: 1.0 },
            score,
            ..Grasp::default()
        }
    }

    fn array(grasps: &[Grasp]) -> GraspArray {
        GraspArray {
            grasps: grasps.to_vec(),
            ..GraspArray::default()
        }
    }

    #[test]
    fn equal_plans_are_the_same_and_a_joint_that_moved_is_not() {
        let recorded = array(&[grasp(0.4, 0.9), grasp(0.45, 0.8)]);
        let found = grasps(&recorded, &recorded.clone());
        assert!(found.same && found.within_tolerance && found.same_order, "{found:?}");
        let mut moved = recorded.clone();
        moved.grasps[0].grasp_joints = vec![0.1; 7];
        let found = grasps(&recorded, &moved);
        assert!(!found.same && found.within_tolerance, "{found:?}");
    }

    #[test]
    fn what_moved_is_measured_and_what_moved_too_far_differs() {
        let recorded = array(&[grasp(0.4, 0.9), grasp(0.45, 0.8)]);
        let near = grasps(&recorded, &array(&[grasp(0.4003, 0.9), grasp(0.45, 0.795)]));
        assert!(!near.same && near.within_tolerance, "{near:?}");
        assert!(
            (near.contact_mm - 0.3).abs() < 1e-6 && (near.score - 0.005).abs() < 1e-6,
            "{near:?}"
        );
        let far = grasps(&recorded, &array(&[grasp(0.402, 0.9), grasp(0.45, 0.8)]));
        assert!(!far.within_tolerance && (far.contact_mm - 2.0).abs() < 1e-6, "{far:?}");
        let mut tilted = recorded.clone();
        tilted.grasps[1].normal = Vector3Message {
            x: 0.02,
            y: 0.0,
            z: 1.0,
        };
        let found = grasps(&recorded, &tilted);
        assert!(
            !found.within_tolerance && (found.angle - 1.146).abs() < 0.01,
            "{found:?}"
        );
    }

    #[test]
    fn missing_grasps_new_ones_and_another_best_one_differ() {
        let (a, b) = (grasp(0.4, 0.9), grasp(0.45, 0.8));
        let both = array(&[a.clone(), b.clone()]);
        let one = array(std::slice::from_ref(&a));
        for (recorded, new) in [(&both, &one), (&one, &both)] {
            let found = grasps(recorded, new);
            assert!(!found.within_tolerance && found.paired == 1, "{found:?}");
        }
        let swapped = grasps(&both, &array(&[b, a]));
        assert!(!swapped.same_order && !swapped.within_tolerance, "{swapped:?}");
        let none = grasps(&array(&[]), &array(&[]));
        assert!(none.same && none.within_tolerance, "{none:?}");
    }

    #[test]
    fn normals_are_compared_where_both_measure() {
        let up = Image::filled(10, 10, [0.0_f32, 0.0, 1.0]);
        let same = normals(&up, &up.clone()).expect("one size");
        assert!(same.same && same.within_tolerance && same.mean_angle < 1e-9, "{same:?}");
        let tilted = Image::from_fn(
            10,
            10,
            |x, _| if x == 0 { [f32::NAN; 3] } else { [0.01, 0.0, 0.999_95] },
        );
        let found = normals(&up, &tilted).expect("one size");
        assert!((found.mean_angle - 0.573).abs() < 0.001, "{found:?}");
        assert!(
            (found.lone_share - 0.1).abs() < 1e-9 && !found.within_tolerance,
            "{found:?}"
        );
        assert!(normals(&up, &Image::filled(9, 10, [0.0; 3])).is_none());
    }
}
