//! The captures of a bag as solvers take them: a stack of exposures and where it was seen from.

mod frames;
mod places;

use anyhow::Context;
use imaging::ExposureStack;
use interfaces::std_msgs::msg::Header;
use photometric::{PixelRays, View};
use recording::Bag;

use frames::Collector;
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

/// Hands every whole capture of a bag to `take`, in the order in which their last images were recorded, and gives back
/// what could not be used, in words.
pub(crate) fn for_each(bag: &Bag, mut take: impl FnMut(Captured) -> anyhow::Result<()>) -> anyhow::Result<Vec<String>> {
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
        match whole.captured(&places) {
            Ok(captured) => take(captured)?,
            Err(error) => problems.push(format!("{what}: {error:#}")),
        }
    }
    problems.extend(collector.left_over());
    Ok(problems)
}
