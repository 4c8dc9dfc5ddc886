//! A plan as messages.

use grasp::Source;
use interfaces::geometry_msgs::msg::PoseStamped;
use interfaces::rakelight_msgs::msg::{Grasp, GraspArray};
use interfaces::std_msgs::msg::Header;

use crate::convert;
use crate::planning::Planned;
use crate::reach::Placed;
use crate::request::Mode;

/// All grasps; `base` is the frame they are in.
pub(crate) fn array(planned: &Planned, base: &str) -> GraspArray {
    let cameras = planned.cameras();
    let grasps = planned.placed.iter();
    GraspArray {
        header: header(planned, base),
        capture_id: planned.capture.id.clone(),
        grasps: grasps.map(|placed| grasp(placed, planned.mode, &cameras)).collect(),
        reason: planned.reason().unwrap_or_default(),
    }
}

/// The best grasp, if the arm reaches any.
pub(crate) fn best_pose(planned: &Planned, base: &str) -> Option<PoseStamped> {
    planned.best().map(|placed| PoseStamped {
        header: header(planned, base),
        pose: convert::pose(&placed.approach.grasp),
    })
}

/// Stamped like the capture's first image.
fn header(planned: &Planned, base: &str) -> Header {
    let stamps = planned.capture.views.iter().map(|view| view.header.stamp);
    Header {
        stamp: stamps.min_by_key(|stamp| stamp.to_nanos()).unwrap_or_default(),
        frame_id: base.to_owned(),
    }
}

fn grasp(placed: &Placed, mode: Mode, cameras: &[&str]) -> Grasp {
    let Placed {
        grasp,
        approach,
        joints,
    } = placed;
    let joints = joints.as_ref().ok();
    Grasp {
        mode: mode.number(),
        contact: convert::point(&grasp.contact.coords),
        normal: convert::vector(&grasp.normal),
        approach_axis: convert::vector(&grasp.approach_axis()),
        pregrasp: convert::pose(&approach.pregrasp),
        grasp: convert::pose(&approach.grasp),
        retreat: convert::pose(&approach.retreat),
        score: grasp.total as f32,
        seal_score: grasp.scores.seal() as f32,
        wrench_score: grasp.scores.wrench() as f32,
        patch_radius: grasp.patch_radius as f32,
        object_radius: grasp.carried.radius as f32,
        object_length: grasp.carried.length as f32,
        pregrasp_joints: joints.map(|angles| angles.pregrasp.to_vec()).unwrap_or_default(),
        grasp_joints: joints.map(|angles| angles.grasp.to_vec()).unwrap_or_default(),
        cameras: seen_by(&grasp.source, cameras),
    }
}

fn seen_by(source: &Source, cameras: &[&str]) -> Vec<String> {
    let name = |view: &usize| cameras.get(*view).map(|name| (*name).to_owned());
    match source {
        Source::BothViews { .. } => [0, 1].iter().filter_map(name).collect(),
        Source::OneView { view, .. } => name(view).into_iter().collect(),
        Source::Outline { pixels, .. } => pixels.iter().filter_map(|(view, _)| name(view)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use geometry::nalgebra::Point2;
    use grasp::Cup;

    use super::*;
    use crate::planning::tests::{planned, planned_on};
    use crate::view::tests::disc;

    #[test]
    fn a_grasp_says_everything() {
        let planned = planned([0.4, 0.0], Cup::default());
        let array = array(&planned, "link_base");
        assert_eq!(
            (array.header.frame_id.as_str(), array.capture_id.as_str()),
            ("link_base", "a")
        );
        assert!(array.reason.is_empty());
        let best = &array.grasps[0];
        assert_eq!(
            (best.mode, best.cameras.as_slice()),
            (Grasp::SOLID, &["c1".to_owned()][..])
        );
        assert!((best.normal.z - 1.0).abs() < 1e-3 && (best.approach_axis.z + 1.0).abs() < 1e-3);
        let height = |pose: &interfaces::geometry_msgs::msg::Pose| pose.position.z - best.contact.z;
        assert!((height(&best.pregrasp) - 0.05).abs() < 1e-4);
        assert!(height(&best.grasp).abs() < 1e-9);
        assert!((height(&best.retreat) - 0.1).abs() < 1e-9);
        for score in [best.score, best.seal_score, best.wrench_score] {
            assert!((0.0..=1.0).contains(&score) && score > 0.1, "{score}");
        }
        assert!(best.patch_radius > 0.01);
        // Half of the plate's diagonal and its height over the table, and 3 mm; the radius is known to a cell.
        assert!((0.0454..0.049).contains(&best.object_radius), "{}", best.object_radius);
        assert!((best.object_length - 0.013).abs() < 0.001, "{}", best.object_length);
        assert_eq!((best.pregrasp_joints.len(), best.grasp_joints.len()), (7, 7));
        let pose = best_pose(&planned, "link_base").expect("within reach");
        assert_eq!((pose.pose, pose.header), (best.grasp, array.header.clone()));
    }

    #[test]
    fn without_reach_there_are_poses_but_no_angles() {
        let planned = planned([1.4, 0.0], Cup::default());
        let array = array(&planned, "link_base");
        assert!(array.grasps[0].grasp_joints.is_empty() && array.grasps[0].pregrasp_joints.is_empty());
        assert!(!array.reason.is_empty() && best_pose(&planned, "link_base").is_none());
    }

    #[test]
    fn a_thin_object_says_so() {
        let array = array(&planned_on(disc("c2", 40.0), Mode::Thin, Cup::default()), "link_base");
        let best = &array.grasps[0];
        assert_eq!(
            (best.mode, best.cameras.as_slice()),
            (Grasp::THIN, &["c2".to_owned()][..])
        );
    }

    #[test]
    fn cameras_are_those_that_saw_it() {
        let outline = Source::Outline {
            pixels: vec![(1, Point2::origin())],
            radius: 0.02,
            coverage: 1.0,
        };
        assert_eq!(seen_by(&outline, &["c1", "c2"]), ["c2"]);
    }
}
