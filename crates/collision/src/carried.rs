//! Objects in the arm's tool.

use crate::arm::{ArmModel, Part};
use crate::error::CollisionError;
use crate::scene::unknown;
use crate::shape::Shape;

/// An object that moves with the tool.
#[derive(Debug, Clone)]
pub struct CarriedObject {
    pub(crate) part: Part,
    /// Links it is looked at against.
    pub(crate) against: Vec<usize>,
}

impl CarriedObject {
    /// Shapes in the frame of the chain's tip, of an object that touches the links in `held_by` and no others.
    ///
    /// # Errors
    /// No shapes, or a link in `held_by` that the arm does not have.
    pub fn new<const N: usize>(
        arm: &ArmModel<N>,
        name: &str,
        shapes_in_tool: &[Shape],
        held_by: &[&str],
    ) -> Result<Self, CollisionError> {
        if shapes_in_tool.is_empty() {
            return Err(CollisionError::Body {
                place: format!("carried object `{name}`"),
                reason: "no shapes".to_owned(),
            });
        }
        if let Some(link) = held_by
            .iter()
            .find(|&&link| arm.link_names().all(|known| known != link))
        {
            return Err(unknown("link", link));
        }
        let shapes = shapes_in_tool
            .iter()
            .map(|shape| shape.moved(&arm.last_from_tool))
            .collect();
        let holds = |link: &Part| held_by.contains(&link.name.as_str());
        let links = arm.links.iter().enumerate();
        Ok(Self {
            part: Part::new(name, N.checked_sub(1), shapes),
            against: links.filter(|(_, link)| !holds(link)).map(|(index, _)| index).collect(),
        })
    }
}
