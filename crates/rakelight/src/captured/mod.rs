//! The captures of a bag as solvers take them: a stack of exposures and where it was seen from.

mod frames;
mod places;

use anyhow::Context;
use geometry::{PinholeCamera, RigidTransform};
use imaging::{ExposureStack, Image};
use interfaces::std_msgs::msg::Header;
use photometric::{PixelRays, View};
use recording::Bag;

use frames::{Collector, Whole};
pub(crate) use places::Places;

/// One camera's share of a capture.
pub(crate) struct Captured {
    /// As the exposures say.
    pub(crate) id: String,
    /// The topics' common beginning, such as `/cell/c1`.
    pub(crate) camera: String,
    /// Of its first image.
    pub(crate) header: Header,
    pub(crate) stack: ExposureStack,
    pub(crate) view: View,
    pub(crate) rays: PixelRays,
}

impl Captured {
    /// The camera's own name, such as `c1`.
    pub(crate) fn camera_name(&self) -> &str {
        self.camera.rsplit('/').next().unwrap_or(&self.camera)
    }
}

/// One camera's image of a capture.
pub(crate) struct Picture {
    /// As the exposures say.
    pub(crate) id: String,
    /// The topics' common beginning, such as `/cell/c1`.
    pub(crate) camera: String,
    /// The camera's optical frame.
    pub(crate) frame: String,
    pub(crate) image: Image<u16>,
    /// As `camera_info` has it.
    pub(crate) lens: anyhow::Result<PinholeCamera>,
    pub(crate) base_from_flange: anyhow::Result<RigidTransform>,
}

/// Hands every whole capture of a bag to `take`, in the order in which their last images were recorded, and gives back
/// what could not be used, in words.
pub(crate) fn for_each(bag: &Bag, take: impl FnMut(Captured) -> anyhow::Result<()>) -> anyhow::Result<Vec<String>> {
    for_each_whole(bag, Whole::captured, take)
}

/// The same with one image of each capture: that under `light`, and where the frame `flange` was then.
pub(crate) fn for_each_picture(
    bag: &Bag,
    light: u8,
    flange: &str,
    take: impl FnMut(Picture) -> anyhow::Result<()>,
) -> anyhow::Result<Vec<String>> {
    for_each_whole(bag, |whole, places| whole.picture(light, flange, places), take)
}

/// What `convert` refuses could not be used; what `take` refuses ends it.
fn for_each_whole<T>(
    bag: &Bag,
    convert: impl Fn(Whole, &Places) -> anyhow::Result<T>,
    mut take: impl FnMut(T) -> anyhow::Result<()>,
) -> anyhow::Result<Vec<String>> {
    let places = Places::read(bag)?;
    let mut collector = Collector::default();
    let mut problems: Vec<String> = bag.report().damage.iter().map(ToString::to_string).collect();
    for message in bag.messages_where(frames::is_wanted) {
        let message = message?;
        let Some(whole) = collector
            .add(&message)
            .with_context(|| format!("a message on {}", message.topic.name))?
        else {
            continue;
        };
        let what = format!("capture {}, {}", whole.id, whole.camera);
        match convert(whole, &places) {
            Ok(converted) => take(converted)?,
            Err(error) => problems.push(format!("{what}: {error:#}")),
        }
    }
    problems.extend(collector.left_over());
    Ok(problems)
}
