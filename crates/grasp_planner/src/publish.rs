//! What is published of a plan.

use grasp::Overlay;
use interfaces::geometry_msgs::msg::PoseStamped;
use interfaces::rakelight_msgs::msg::GraspArray;
use interfaces::sensor_msgs::msg::CompressedImage;
use ros::{Node, Publisher, Qos};

use crate::convert;
use crate::error::Error;
use crate::planning::Planned;

pub(crate) struct Publishers {
    grasps: Publisher<GraspArray>,
    pose: Publisher<PoseStamped>,
    /// By camera.
    previews: Vec<(String, Publisher<CompressedImage>)>,
}

impl Publishers {
    pub(crate) fn new(node: &Node, cameras: &[String]) -> Result<Self, Error> {
        let preview = |camera: &String| {
            let publisher = node.publisher(&format!("{camera}/grasps/preview"), Qos::MAP)?;
            Ok::<_, ros::Error>((camera.clone(), publisher))
        };
        Ok(Self {
            grasps: node.publisher("grasps", Qos::STREAM)?,
            pose: node.publisher("grasp_pose", Qos::STREAM)?,
            previews: cameras.iter().map(preview).collect::<Result<_, _>>()?,
        })
    }

    pub(crate) fn grasps(&self, grasps: GraspArray, best: Option<PoseStamped>) -> Result<(), ros::Error> {
        if let Some(pose) = best {
            self.pose.publish(pose)?;
        }
        self.grasps.publish(grasps)
    }

    /// Pictures take longer than plans: only those that somebody looks at are drawn.
    pub(crate) fn previews(&self, planned: &Planned) {
        for view in &planned.capture.views {
            let of_camera = self.previews.iter().find(|(camera, _)| *camera == view.camera);
            let Some((camera, publisher)) = of_camera.filter(|(_, publisher)| publisher.subscription_count() > 0)
            else {
                continue;
            };
            let mut overlay = Overlay::on_relief(&view.input());
            overlay.plan(&planned.plan, &planned.settings.cup);
            let outcome = match convert::preview(view.header.clone(), &overlay) {
                Ok(preview) => publisher.publish(preview).map_err(|error| error.to_string()),
                Err(error) => Err(error.to_string()),
            };
            if let Err(error) = outcome {
                tracing::warn!(camera, error, "a preview is lost");
            }
        }
    }
}
