//! What was seen of the target.

use geometry::RigidTransform;
use nalgebra::Point2;

use crate::detect::DetectedCorner;
use crate::homography::Match;
use crate::target::CharucoTarget;

/// Views whose corners are nearer to each other, on average, show the same thing, pixels.
const SAME_PX: f64 = 1.0;

/// The target in one image.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetView {
    /// What people call the image. Views of several cameras with the same name were taken at the same time.
    pub name: String,
    /// As found.
    pub corners: Vec<DetectedCorner>,
}

/// All that a camera saw.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraViews {
    /// Its name, such as `c1`.
    pub camera: String,
    /// Width and height of its images.
    pub size: [usize; 2],
    /// In the order in which they were taken.
    pub views: Vec<TargetView>,
}

impl CameraViews {
    /// The same as before the last view was taken; without views nothing changes.
    #[must_use]
    pub fn without_last_view(mut self) -> Self {
        self.views.pop();
        self
    }
}

/// How well a view fits, or why it was not used.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewReport {
    /// The view's name.
    pub name: String,
    /// Where the target was; none when the view was not used.
    pub camera_from_target: Option<RigidTransform>,
    /// Root mean square distance of its corners from where they fall, pixels; 0 when it was not used.
    pub rms_px: f64,
    /// Corners seen.
    pub corners: usize,
    /// Why it was not used.
    pub left_out: Option<String>,
}

impl ViewReport {
    pub(crate) fn left_out(view: &TargetView, reason: String) -> Self {
        Self {
            name: view.name.clone(),
            camera_from_target: None,
            rms_px: 0.0,
            corners: view.corners.len(),
            left_out: Some(reason),
        }
    }
}

/// The used view that fits worst.
pub(crate) fn worst(views: &[ViewReport]) -> Option<&ViewReport> {
    let used = views.iter().filter(|view| view.left_out.is_none());
    used.max_by(|a, b| a.rms_px.total_cmp(&b.rms_px))
}

/// Root mean square over all corners of the used views, pixels.
pub(crate) fn rms(views: &[ViewReport]) -> f64 {
    let used = views.iter().filter(|view| view.left_out.is_none());
    let (mut squares, mut corners) = (0.0, 0);
    for view in used {
        squares += view.rms_px.powi(2) * view.corners as f64;
        corners += view.corners;
    }
    (squares / corners.max(1) as f64).sqrt()
}

/// Corners on the target and in the image; corners that the target does not have are not there.
pub(crate) fn matches(target: &CharucoTarget, corners: &[DetectedCorner]) -> Vec<Match> {
    let pair = |corner: &DetectedCorner| Some((target.corner(corner.id)?, corner.pixel));
    corners.iter().filter_map(pair).collect()
}

/// Whether two views show the target at the same place.
pub(crate) fn are_same(a: &[DetectedCorner], b: &[DetectedCorner]) -> bool {
    let other = |id: usize| b.iter().find(|corner| corner.id == id).map(|corner| corner.pixel);
    let distance = |corner: &DetectedCorner| -> Option<f64> {
        let there: Point2<f64> = other(corner.id)?;
        Some((corner.pixel - there).norm())
    };
    let distances: Vec<f64> = a.iter().filter_map(distance).collect();
    2 * distances.len() > a.len().min(b.len()) && distances.iter().sum::<f64>() < SAME_PX * distances.len() as f64
}
