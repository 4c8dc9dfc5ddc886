//! Which grasps are tried, and which were.

use geometry::nalgebra::Point3;
use interfaces::rakelight_msgs::msg::Grasp;

/// A contact this near to one that failed is the same one, metres: less than a cup's radius.
const SAME_CONTACT: f64 = 0.008;
/// An object that is still there has a grasp this near to the one that was taken, metres.
const STILL_THERE: f64 = 0.015;
/// What it lay on has one this much lower, or more.
const BELOW_IT: f64 = 0.002;

pub(super) fn contact(grasp: &Grasp) -> Point3<f64> {
    Point3::new(grasp.contact.x, grasp.contact.y, grasp.contact.z)
}

/// Those that the arm reaches and that have not failed, as the planner ranked them.
pub(super) fn worth_trying(grasps: Vec<Grasp>, failed: &[Point3<f64>]) -> Vec<Grasp> {
    let is_new = |grasp: &Grasp| !is_among(&contact(grasp), failed);
    let is_reached = |grasp: &Grasp| !grasp.pregrasp_joints.is_empty() && !grasp.grasp_joints.is_empty();
    grasps
        .into_iter()
        .filter(|grasp| is_reached(grasp) && is_new(grasp))
        .collect()
}

/// Whether a contact is the same as one of those.
pub(super) fn is_among(contact: &Point3<f64>, those: &[Point3<f64>]) -> bool {
    those.iter().any(|at| (contact - at).norm() <= SAME_CONTACT)
}

/// Whether something can still be grasped where an object was taken.
pub(super) fn is_still_there(grasps: &[Grasp], taken: &Point3<f64>) -> bool {
    let is_there = |at: Point3<f64>| (at - taken).norm() <= STILL_THERE && at.z > taken.z - BELOW_IT;
    grasps.iter().map(contact).any(is_there)
}

/// "at (0.430, 0.010, 0.029) m", for people.
pub(super) fn place(grasp: &Grasp) -> String {
    let at = &grasp.contact;
    format!("at ({:.3}, {:.3}, {:.3}) m", at.x, at.y, at.z)
}

/// Whether `text` speaks of `name` as a word of its own.
pub(super) fn names(text: &str, name: &str) -> bool {
    text.split(|letter: char| !letter.is_alphanumeric() && letter != '_')
        .any(|word| word == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grasp(x: f64, is_reached: bool) -> Grasp {
        let joints = if is_reached { vec![0.0; 7] } else { Vec::new() };
        let mut grasp = Grasp {
            pregrasp_joints: joints.clone(),
            grasp_joints: joints,
            ..Grasp::default()
        };
        grasp.contact.x = x;
        grasp
    }

    #[test]
    fn what_failed_and_what_is_out_of_reach_is_not_tried() {
        let grasps = vec![grasp(0.400, true), grasp(0.420, false), grasp(0.430, true)];
        let left = worth_trying(grasps, &[Point3::new(0.405, 0.0, 0.0)]);
        assert_eq!(left.len(), 1);
        assert!((left[0].contact.x - 0.43).abs() < 1e-12);
    }

    #[test]
    fn an_object_is_gone_when_nothing_near_can_be_grasped_in_reach_or_not() {
        let taken = Point3::new(0.4, 0.0, 0.0);
        assert!(is_still_there(&[grasp(0.414, false)], &taken));
        assert!(!is_still_there(&[grasp(0.416, true)], &taken));
        assert!(!is_still_there(&[], &taken));
    }

    #[test]
    fn what_an_object_lay_on_is_not_the_object() {
        let mut below = grasp(0.4, true);
        below.contact.z = -0.003;
        let taken = Point3::new(0.4, 0.0, 0.0);
        assert!(!is_still_there(&[below.clone()], &taken));
        below.contact.z = -0.001;
        assert!(is_still_there(&[below], &taken));
    }

    #[test]
    fn a_camera_is_named_by_a_whole_word() {
        assert!(names("c2: no answer", "c2") && names("the capture is void: c2's frame 3", "c2"));
        assert!(!names("camera c21 is away", "c2") && !names("c2_old is away", "c2"));
    }
}
