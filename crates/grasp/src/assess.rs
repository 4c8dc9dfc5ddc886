//! From a surface to a grasp, or to a refusal.

use geometry::nalgebra::{Matrix3, Point3, Vector3};

use crate::carried::{Axis, Objects};
use crate::chart::{Chart, Grid, Tangent};
use crate::cup::Cup;
use crate::directions::misalignment;
use crate::footprint::{Circle, Footprint};
use crate::options::PlanOptions;
use crate::refusal::{Failure, Refused, Test};
use crate::result::{Carried, Grasp, Measured, Scores, Source};
use crate::specks::SPECK;
use crate::stem::{Lift, SurfacePoints};
use crate::surface::{Place, Surface};
use crate::triangulate::{covariance, covariance_at_depth};
use crate::view::{DEPTH_REACH, View};

/// Cells of a footprint's chart across the cup's radius, and from its middle to its border.
const CELLS: f64 = 8.0;
const HALF: usize = 18;
/// Holes up to this area may be taken for noise where a place is looked for, square metres.
const LARGE_SPECK: f64 = 9e-6;
/// Share of the footprint that may stand in the stem's way.
const BLOCKED: f64 = 0.04;
/// Cone beyond the sampled orientations in which normals are still served, as a share of their step.
const BEYOND_CONE: f64 = 0.5;

/// What all candidates are held against.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bench<'a> {
    pub(crate) views: &'a [View<'a>],
    /// By view.
    pub(crate) points: &'a [SurfacePoints],
    /// By view.
    pub(crate) objects: &'a [Objects],
    pub(crate) directions: &'a [Vector3<f64>],
    pub(crate) cup: &'a Cup,
    pub(crate) options: &'a PlanOptions,
}

/// A candidate's place with what its views measure there.
struct Candidate<'a> {
    surface: &'a Surface,
    place: Place,
    footprints: Vec<Footprint>,
    covariance: Matrix3<f64>,
    measured: Measured,
}

impl Bench<'_> {
    /// The best place on a surface, if it passes all tests.
    pub(crate) fn assess(&self, surface: &Surface) -> Result<Grasp, Box<Refused>> {
        let candidate = self.candidate(surface);
        let failures: Vec<Failure> = self.failures(&candidate);
        if failures.is_empty() {
            return Ok(self.grasp(&candidate));
        }
        Err(Box::new(Refused {
            views: surface.views.clone(),
            pixel: self.views[surface.views[0]].project(&candidate.place.point),
            contact: Some(candidate.place.point),
            normal: Some(candidate.place.normal),
            failures,
        }))
    }

    /// Where the cup would stand. Where noise leaves no place wide enough, larger holes are taken for noise as well, which
    /// the footprint then confirms or refutes.
    fn candidate<'a>(&self, surface: &'a Surface) -> Candidate<'a> {
        let centre = self.centre_of_mass(surface);
        let fold = self.options.search.fold.cos();
        let place = |speck: f64| surface.best_place(self.cup, fold, speck, &centre);
        let strict = place(SPECK);
        let at_strict = self.candidate_at(surface, strict, &centre);
        if at_strict.measured.border >= self.cup.radius() + self.options.limits.border {
            return at_strict;
        }
        let generous = place(LARGE_SPECK);
        if generous == strict {
            return at_strict;
        }
        let at_generous = self.candidate_at(surface, generous, &centre);
        if at_generous.measured.border > at_strict.measured.border {
            at_generous
        } else {
            at_strict
        }
    }

    fn candidate_at<'a>(&self, surface: &'a Surface, mut place: Place, centre: &Point3<f64>) -> Candidate<'a> {
        let circle = Circle {
            radius: self.cup.radius(),
            edge_width: self.options.limits.edge_width,
            fold: self.options.search.fold.cos(),
        };
        let grid = Grid {
            pitch: self.cup.radius() / CELLS,
            half: HALF,
        };
        let tangent = Tangent::new(place.point, place.normal);
        let measure = |&view: &usize| Footprint::measure(&Chart::new(&self.views[view], tangent, grid, None), &circle);
        let footprints: Vec<Footprint> = surface.views.iter().map(measure).collect();
        let mean: Vector3<f64> = footprints.iter().map(|footprint| footprint.normal).sum();
        place.normal = mean.try_normalize(1e-9).unwrap_or(place.normal);
        let covariance = self.covariance(surface, &place);
        Candidate {
            surface,
            place,
            covariance,
            measured: self.measured(surface, &place, &footprints, &covariance, centre),
            footprints,
        }
    }

    fn measured(
        &self,
        surface: &Surface,
        place: &Place,
        footprints: &[Footprint],
        covariance: &Matrix3<f64>,
        centre: &Point3<f64>,
    ) -> Measured {
        let most = |value: fn(&Footprint) -> f64| footprints.iter().map(value).fold(0.0, f64::max);
        let least = |value: fn(&Footprint) -> f64| footprints.iter().map(value).fold(f64::INFINITY, f64::min);
        Measured {
            misalignment: misalignment(&place.normal, self.directions),
            area: surface.area,
            edge_share: most(|footprint| footprint.edge_share),
            edge_moment: most(|footprint| footprint.edge_moment),
            gap: most(|footprint| footprint.gap),
            confidence: least(|footprint| footprint.confidence),
            border: least(|footprint| footprint.border),
            from_centre: (place.point - centre).xy().norm(),
            sigma: place.normal.dot(&(covariance * place.normal)).max(0.0).sqrt(),
        }
    }

    fn failures(&self, candidate: &Candidate<'_>) -> Vec<Failure> {
        let (limits, cup, measured) = (&self.options.limits, self.cup, &candidate.measured);
        let Place { point, normal } = candidate.place;
        let height = point.z - self.options.table_height;
        let lowest = height - cup.reach_down(normal.z);
        let cone = self.options.search.cone + BEYOND_CONE * self.options.search.step;
        let mismatch = candidate.surface.offset.map_or(0.0, |offset| offset.mismatch);
        let tests = [
            Failure::below(Test::Border, measured.border, cup.radius() + limits.border),
            Failure::above(Test::EdgeShare, measured.edge_share, limits.edge_share),
            Failure::above(Test::EdgeMoment, measured.edge_moment, limits.edge_moment),
            Failure::above(Test::Gap, measured.gap, cup.compliance),
            Failure::below(Test::Confidence, measured.confidence, limits.confidence),
            Failure::above(Test::Alignment, measured.misalignment, cone),
            Failure::below(Test::TableClearance, lowest, limits.clearance),
            Failure::above(Test::Height, height, self.options.highest),
            self.blocked(&candidate.surface.views, &candidate.place),
            Failure::above(Test::Mismatch, mismatch, self.options.matching.mismatch),
            Failure::above(Test::Uncertainty, measured.sigma, limits.uncertainty),
        ];
        tests.into_iter().flatten().collect()
    }

    fn grasp(&self, candidate: &Candidate<'_>) -> Grasp {
        let scores = self.scores(&candidate.measured);
        Grasp {
            contact: candidate.place.point,
            covariance: candidate.covariance,
            normal: candidate.place.normal,
            source: self.source(candidate),
            patch_radius: candidate.measured.border,
            carried: self.carried(candidate),
            scores,
            measured: candidate.measured,
            total: scores.total(&self.options.weights),
        }
    }

    /// The larger of what the views show.
    fn carried(&self, candidate: &Candidate<'_>) -> Carried {
        let axis = Axis {
            contact: candidate.place.point,
            direction: -candidate.place.normal,
            table_height: self.options.table_height,
        };
        let patch = Carried {
            radius: candidate.measured.border,
            length: 0.0,
        };
        let surface = candidate.surface;
        let shown = surface.views.iter().zip(&surface.patches);
        let around = shown.map(|(&view, patch)| self.objects[view].around(patch.object, &self.views[view], &axis));
        around.fold(patch, |all, next| all.and(&next)).bounded()
    }

    /// How far each measure is from its limit.
    pub(crate) fn scores(&self, measured: &Measured) -> Scores {
        let (limits, cup) = (&self.options.limits, self.cup);
        let left = |value: f64, limit: f64| (1.0 - value / limit.max(1e-9)).clamp(0.0, 1.0);
        let radius = cup.radius();
        let footprint = std::f64::consts::PI * radius * radius;
        Scores {
            alignment: measured.misalignment.cos().clamp(0.0, 1.0),
            area: (measured.area / (4.0 * footprint)).clamp(0.0, 1.0),
            edges: left(measured.edge_share, limits.edge_share),
            balance: left(measured.edge_moment, limits.edge_moment),
            curvature: left(measured.gap, cup.compliance),
            confidence: measured.confidence.clamp(0.0, 1.0),
            border: ((measured.border - radius) / radius).clamp(0.0, 1.0),
            centre: (-measured.from_centre / (2.0 * cup.diameter)).exp(),
            certainty: left(measured.sigma, limits.uncertainty),
        }
    }

    fn source(&self, candidate: &Candidate<'_>) -> Source {
        let (surface, point) = (candidate.surface, &candidate.place.point);
        // A contact outside an image would have failed the test of its border there.
        let pixel = |view: usize| self.views[view].project(point).unwrap_or(surface.patches[0].middle);
        let (Some(offset), [a, b]) = (surface.offset, candidate.footprints.as_slice()) else {
            let view = surface.views[0];
            return Source::OneView {
                view,
                pixel: pixel(view),
            };
        };
        Source::BothViews {
            pixels: [pixel(0), pixel(1)],
            epipolar_px: surface.epipolar_px,
            normal_angle: a.normal.dot(&b.normal).clamp(-1.0, 1.0).acos(),
            mismatch: offset.mismatch,
        }
    }

    fn covariance(&self, surface: &Surface, place: &Place) -> Matrix3<f64> {
        let limits = &self.options.matching;
        let found = match surface.views.as_slice() {
            [view] => covariance_at_depth(&self.views[*view], &place.point, limits.sigma_px, limits.sigma_depth),
            _ => covariance(&self.views.iter().collect::<Vec<_>>(), &place.point, limits.sigma_px),
        };
        found.unwrap_or_else(|| Matrix3::from_diagonal_element(self.options.highest.powi(2)))
    }

    /// That something a view shows is in the way of stem or gripper. Those that found the contact may have the whole
    /// object's depth as wrong as the contact's; to the others it is where it is.
    pub(crate) fn blocked(&self, found_by: &[usize], Place { point, normal }: &Place) -> Option<Failure> {
        let lift = |view: usize| {
            let view = &self.views[view];
            let pixel = view.project(point)?;
            let depth = view.depth_near(&pixel, DEPTH_REACH)?;
            Some(Lift {
                object: view.level.object_at(&pixel),
                height: (view.ray(&pixel)?.at(depth) - point).dot(normal),
            })
        };
        let blocked = |view: usize| {
            let lift = if found_by.contains(&view) {
                lift(view)?
            } else {
                Lift::default()
            };
            let margin = self.options.limits.stem_margin;
            Some(self.points[view].in_the_way(point, normal, lift, self.cup, margin))
        };
        let area = (0..self.views.len()).filter_map(blocked).fold(0.0, f64::max);
        let footprint = std::f64::consts::PI * self.cup.radius() * self.cup.radius();
        Failure::above(Test::Stem, area, BLOCKED * footprint)
    }

    /// Middle of the object's outline, taken to lie at half the contact's height; the mean of the views that show it.
    fn centre_of_mass(&self, surface: &Surface) -> Point3<f64> {
        let table = self.options.table_height;
        let height = table + (surface.tangent.origin.z - table).max(0.0) / 2.0;
        let middle = |(&view, patch): (&usize, &crate::patch::Patch)| {
            let view = &self.views[view];
            let (pixel, _) = view
                .level
                .object_middles
                .get(usize::from(patch.object.checked_sub(1)?))?;
            view.on_level(pixel, height)
        };
        let found: Vec<Point3<f64>> = surface.views.iter().zip(&surface.patches).filter_map(middle).collect();
        if found.is_empty() {
            return surface.tangent.origin;
        }
        let sum: Vector3<f64> = found.iter().map(|point| point.coords).sum();
        Point3::from(sum / found.len() as f64)
    }
}
