//! What was looked at and refused, and why.

use std::fmt;

use geometry::nalgebra::{Point2, Point3, Vector3};

/// What a candidate must pass. Values are SI; texts are for people.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Test {
    /// Pixels of the view's mask: enough for a cup.
    ObjectPixels,
    /// Likelihood in the view as a share of the cup's footprint: some surface must face a reachable direction.
    FacingSurface,
    /// Angle between normal and nearest reachable direction, radians.
    Alignment,
    /// From the contact to where the patch or the object ends, metres; at least the cup's radius and a margin.
    Border,
    /// Share of the footprint that edges cover.
    EdgeShare,
    /// First moment of the edges in the footprint.
    EdgeMoment,
    /// What the lip must give, metres.
    Gap,
    /// Mean confidence in the footprint.
    Confidence,
    /// Distance of the lowest place of lip and gripper from the table, metres.
    TableClearance,
    /// Surface within the cup's and the stem's way, square metres.
    Stem,
    /// Standard deviation of the contact along the approach, metres.
    Uncertainty,
    /// Height of the contact over the table, metres.
    Height,
    /// Contradiction between both views' normals, as a share of the patch.
    Mismatch,
    /// Views with a depth where only one view shows the patch.
    Depth,
    /// From the object to the image's border, pixels, where only one view shows the patch: its depth is known from where
    /// the object stands on the table.
    Cut,
    /// Share of a thin object's outline on which edges were found.
    Outline,
    /// Outlines in the view that could be a thin object's.
    Outlines,
    /// Views that show an outline.
    OutlinePair,
}

/// A test that was not passed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Failure {
    /// Which one.
    pub test: Test,
    /// What was measured.
    pub value: f64,
    /// What was allowed: the largest or the least value, by the test.
    pub allowed: f64,
}

/// A candidate that is no grasp.
#[derive(Debug, Clone, PartialEq)]
pub struct Refused {
    /// Positions of the views that show it, in the order given.
    pub views: Vec<usize>,
    /// Where the first of these views shows it; none for the view as a whole.
    pub pixel: Option<Point2<f64>>,
    /// Base frame, metres, where it was found out.
    pub contact: Option<Point3<f64>>,
    /// Base frame, unit.
    pub normal: Option<Vector3<f64>>,
    /// Every test that failed, at least one.
    pub failures: Vec<Failure>,
}

impl Failure {
    /// Of a value that may be at most so large.
    pub(crate) fn above(test: Test, value: f64, allowed: f64) -> Option<Self> {
        let is_kept = value <= allowed;
        (!is_kept).then_some(Self { test, value, allowed })
    }

    /// Of a value that must be at least so large.
    pub(crate) fn below(test: Test, value: f64, allowed: f64) -> Option<Self> {
        let is_kept = value >= allowed;
        (!is_kept).then_some(Self { test, value, allowed })
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { test, value, allowed } = *self;
        let (mm, least_mm) = (1e3 * value, 1e3 * allowed);
        let (percent, most_percent) = (1e2 * value, 1e2 * allowed);
        match test {
            Test::ObjectPixels => write!(f, "{value:.0} object pixels, a cup needs {allowed:.0}"),
            Test::FacingSurface => write!(
                f,
                "surface that faces a reachable direction: {percent:.0} % of the cup's footprint, needed {most_percent:.0} %"
            ),
            Test::Alignment => write!(
                f,
                "normal is {:.0} degrees off every reachable direction, allowed {:.0}",
                value.to_degrees(),
                allowed.to_degrees()
            ),
            Test::Border => write!(f, "patch ends {mm:.1} mm from the contact, needed {least_mm:.1} mm"),
            Test::EdgeShare => write!(
                f,
                "edges cover {percent:.1} % of the footprint, allowed {most_percent:.1} %"
            ),
            Test::EdgeMoment => write!(f, "edges' first moment is {value:.3}, allowed {allowed:.3}"),
            Test::Gap => write!(f, "lip must give {mm:.2} mm, allowed {least_mm:.2} mm"),
            Test::Confidence => write!(f, "mean confidence is {value:.2}, needed {allowed:.2}"),
            Test::TableClearance => write!(
                f,
                "lip or gripper comes within {mm:.1} mm of the table, needed {least_mm:.1} mm"
            ),
            Test::Stem => write!(
                f,
                "{:.0} square mm of surface in the stem's way, allowed {:.0}",
                1e6 * value,
                1e6 * allowed
            ),
            Test::Uncertainty => write!(f, "known to {mm:.1} mm along the approach, needed {least_mm:.1} mm"),
            Test::Height => write!(f, "{mm:.0} mm over the table, expected 0 to {least_mm:.0} mm"),
            Test::Mismatch => write!(
                f,
                "views contradict on {percent:.0} % of it, allowed {most_percent:.0} %"
            ),
            Test::Depth => write!(f, "one view shows it, {value:.0} depths there, needed {allowed:.0}"),
            Test::Cut => write!(
                f,
                "one view shows it, {value:.0} pixels from the image's border, needed {allowed:.0}"
            ),
            Test::Outline => write!(f, "edges on {percent:.0} % of the outline, needed {most_percent:.0} %"),
            Test::Outlines => write!(f, "{value:.0} outlines of a thin object, needed {allowed:.0}"),
            Test::OutlinePair => write!(f, "outline in {value:.0} view, needed in {allowed:.0}"),
        }
    }
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let views: Vec<String> = self.views.iter().map(|view| (view + 1).to_string()).collect();
        write!(f, "view {}", views.join(" and "))?;
        if let Some(pixel) = self.pixel {
            write!(f, " at ({:.0}, {:.0})", pixel.x, pixel.y)?;
        }
        if let Some(contact) = self.contact.map(|contact| 1e3 * contact) {
            write!(f, ", ({:.0}, {:.0}, {:.1}) mm", contact.x, contact.y, contact.z)?;
        }
        for (index, failure) in self.failures.iter().enumerate() {
            write!(f, "{} {failure}", if index == 0 { ":" } else { ";" })?;
        }
        Ok(())
    }
}
