//! What is known of a view, and where its pixels and points are.

use geometry::nalgebra::{Matrix3, Point2, Point3, Vector3};
use geometry::{PinholeCamera, Ray, RigidTransform};
use imaging::{Image, Mask};

use crate::cup::Cup;
use crate::error::GraspError;
use crate::level::{Blocks, Level};
use crate::options::PlanOptions;

/// Edges of this confidence and above count in full.
const SURE_EDGE: f32 = 0.35;
/// Edges of no confidence still count a little: something closed a gap there.
const LEAST_EDGE: f32 = 0.25;
/// Cells that charts read across the cup's radius, at least.
const FINE_CELLS_ACROSS_RADIUS: f64 = 12.0;
/// Cells of the coarse level across the cup's radius, at least.
const CELLS_ACROSS_RADIUS: f64 = 6.0;
/// Pixels around a place in which its depth is taken.
pub(crate) const DEPTH_REACH: usize = 3;

/// Differences that take the place of derivatives of the lens, metres.
const JACOBIAN_STEP: f64 = 1e-5;

/// Shading results of one calibrated view. All images have the camera's size.
#[derive(Debug, Clone, Copy)]
pub struct ViewInput<'a> {
    /// Such as `c1`; names the view in refusals.
    pub name: &'a str,
    /// Lens and image.
    pub camera: PinholeCamera,
    /// Where it stands; metres.
    pub base_from_camera: RigidTransform,
    /// Unit vectors, base frame; NaN where there is none.
    pub normals: &'a Image<[f32; 3]>,
    /// Of the normals, 0 to 1.
    pub confidence: &'a Image<f32>,
    /// Where one surface hides another.
    pub edges: &'a Mask,
    /// Of the edges, 0 to 1.
    pub edge_confidence: &'a Image<f32>,
    /// The objects' pixels.
    pub mask: &'a Mask,
    /// Along the optical axis, metres, in the base's scale; NaN where there is none.
    pub depth: Option<&'a Image<f32>>,
}

/// A view made ready for planning.
#[derive(Debug)]
pub(crate) struct View<'a> {
    pub(crate) input: ViewInput<'a>,
    /// The camera's centre, base frame.
    pub(crate) centre: Point3<f64>,
    camera_from_base: RigidTransform,
    rotation: Matrix3<f64>,
    shift: Vector3<f64>,
    /// What charts read.
    pub(crate) fine: Blocks,
    pub(crate) level: Level,
    pub(crate) edges: Vec<EdgePixel>,
    /// By object of the level (0: none): what its integrated depth is short of, metres.
    depth_offsets: Vec<f64>,
}

/// One pixel of an edge.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EdgePixel {
    /// From the camera's centre, base frame, any length.
    pub(crate) ray: Vector3<f64>,
    pub(crate) weight: f32,
}

impl<'a> View<'a> {
    pub(crate) fn new(input: &ViewInput<'a>, cup: &Cup, options: &PlanOptions) -> Result<Self, GraspError> {
        check_sizes(input)?;
        let centre = Point3::from(input.base_from_camera.translation());
        let height = centre.z - options.table_height;
        if height.is_nan() || height <= 0.01 {
            let view = input.name.to_owned();
            return Err(GraspError::BelowTable { view, height });
        }
        let camera_from_base = input.base_from_camera.inverse();
        let mut view = Self {
            input: *input,
            centre,
            camera_from_base,
            rotation: camera_from_base.rotation_matrix(),
            shift: camera_from_base.translation(),
            fine: Blocks::default(),
            level: Level::default(),
            edges: Vec::new(),
            depth_offsets: Vec::new(),
        };
        let distance = view.distance_to_table(options.table_height);
        let cup_px = cup.radius() * input.camera.focal()[0] / distance;
        let fine = ((cup_px / FINE_CELLS_ACROSS_RADIUS).floor()).clamp(1.0, 8.0);
        let coarser = (cup_px / fine / CELLS_ACROSS_RADIUS).floor().clamp(1.0, 16.0);
        view.fine = Blocks::new(input, fine as usize);
        view.level = Level::new(view.fine.coarser(coarser as usize));
        view.edges = view.edge_pixels();
        view.depth_offsets = vec![0.0; view.level.object_middles.len() + 1];
        Ok(view)
    }

    /// Camera axes from base axes, and the base's origin in the camera frame.
    pub(crate) fn camera_from_base(&self) -> (&Matrix3<f64>, &Vector3<f64>) {
        (&self.rotation, &self.shift)
    }

    /// The pixel of a point, which may lie outside the image.
    pub(crate) fn project(&self, point: &Point3<f64>) -> Option<Point2<f64>> {
        let point = self.rotation * point.coords + self.shift;
        self.input.camera.project(&point.into())
    }

    /// The ray through a pixel, base frame; `at(z)` is the point of depth z.
    pub(crate) fn ray(&self, pixel: &Point2<f64>) -> Option<Ray> {
        let direction = self.input.camera.unproject(pixel).ok()?;
        Some(Ray {
            origin: self.centre,
            direction: self.input.base_from_camera.transform_direction(&direction),
        })
    }

    /// Where the ray of a pixel meets a level plane.
    pub(crate) fn on_level(&self, pixel: &Point2<f64>, height: f64) -> Option<Point3<f64>> {
        let ray = self.ray(pixel)?;
        let depth = (height - ray.origin.z) / ray.direction.z;
        (depth > 0.0 && depth.is_finite()).then(|| ray.at(depth))
    }

    /// Cosine between a normal and the direction to the camera.
    pub(crate) fn facing(&self, point: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
        (self.centre - point).normalize().dot(normal)
    }

    /// Derivative of pixel by point, by rows.
    pub(crate) fn jacobian(&self, point: &Point3<f64>) -> Option<[Vector3<f64>; 2]> {
        let slope = |axis: usize| {
            let offset = Vector3::ith(axis, JACOBIAN_STEP);
            let change = self.project(&(point + offset))? - self.project(&(point - offset))?;
            Some(change / (2.0 * JACOBIAN_STEP))
        };
        let [x, y, z] = [slope(0)?, slope(1)?, slope(2)?];
        Some([Vector3::new(x.x, y.x, z.x), Vector3::new(x.y, y.y, z.y)])
    }

    /// Moves an object's depth, metres.
    pub(crate) fn move_depth(&mut self, object: u16, by: f64) {
        if object > 0 {
            self.depth_offsets[usize::from(object)] += by;
        }
    }

    /// Depth of a cell of the level; none where there is none.
    pub(crate) fn depth_of(&self, cell: usize) -> Option<f64> {
        let depth = f64::from(self.level.blocks.cells[cell].depth);
        (!depth.is_nan()).then(|| depth + self.depth_offsets[usize::from(self.level.object_near(cell))])
    }

    /// Median of the depth within some pixels of a pixel; none where there is none.
    pub(crate) fn depth_near(&self, pixel: &Point2<f64>, reach: usize) -> Option<f64> {
        let image = self.input.depth?;
        let (x, y) = (pixel.x.round().max(0.0) as usize, pixel.y.round().max(0.0) as usize);
        let rows = y.saturating_sub(reach)..=y + reach;
        let at = |x: usize, y: usize| image.get(x, y).copied();
        let near = rows.flat_map(|y| (x.saturating_sub(reach)..=x + reach).filter_map(move |x| at(x, y)));
        let mut found: Vec<f32> = near.filter(|depth| depth.is_finite() && *depth > 0.0).collect();
        found.sort_by(f32::total_cmp);
        let offset = self.depth_offsets[usize::from(self.level.object_at(pixel))];
        found.get(found.len() / 2).map(|&depth| f64::from(depth) + offset)
    }

    /// How near an object comes to the image's border, pixels; far away for no object.
    pub(crate) fn rim_of(&self, object: u16) -> f64 {
        let blocks = &self.level.blocks;
        let (right, below) = (
            self.input.camera.width() as f64 - 1.0,
            self.input.camera.height() as f64 - 1.0,
        );
        let half = blocks.factor as f64 / 2.0;
        let cells = (0..blocks.cells.len()).filter(|&index| object > 0 && self.level.object_of(index) == object);
        let rims = cells.map(|index| {
            let at = blocks.pixel((index % blocks.width) as f64, (index / blocks.width) as f64);
            at.x.min(at.y).min(right - at.x).min(below - at.y) - half
        });
        rims.fold(f64::INFINITY, f64::min)
    }

    /// Along the optical axis; at most 10 m, else the height alone.
    pub(crate) fn distance_to_table(&self, height: f64) -> f64 {
        let [x, y] = self.input.camera.principal();
        let middle = self.on_level(&Point2::new(x, y), height);
        let depth = middle.map(|point| self.camera_from_base.transform_point(&point).z);
        depth.filter(|z| *z < 10.0).unwrap_or(self.centre.z - height)
    }

    fn edge_pixels(&self) -> Vec<EdgePixel> {
        let confidence = self.input.edge_confidence;
        let mut found = Vec::new();
        for (y, row) in self.input.edges.as_image().rows().enumerate() {
            for (x, _) in row.iter().enumerate().filter(|(_, edge)| **edge != 0) {
                let Some(ray) = self.ray(&Point2::new(x as f64, y as f64)) else {
                    continue;
                };
                let confidence = confidence.row(y)[x];
                let sure = if confidence.is_finite() {
                    confidence / SURE_EDGE
                } else {
                    0.0
                };
                found.push(EdgePixel {
                    ray: ray.direction,
                    weight: sure.clamp(LEAST_EDGE, 1.0),
                });
            }
        }
        found
    }
}

fn check_sizes(input: &ViewInput<'_>) -> Result<(), GraspError> {
    fn size<T>(image: &Image<T>) -> (usize, usize) {
        (image.width(), image.height())
    }
    let sizes = [
        ("the normal map", Some(size(input.normals))),
        ("the confidence", Some(size(input.confidence))),
        ("the edges", Some(size(input.edges.as_image()))),
        ("the edge confidence", Some(size(input.edge_confidence))),
        ("the mask", Some(size(input.mask.as_image()))),
        ("the depth", input.depth.map(size)),
    ];
    let (expected_width, expected_height) = (input.camera.width(), input.camera.height());
    for (what, found) in sizes {
        let Some((width, height)) = found else { continue };
        if (width, height) != (expected_width, expected_height) {
            return Err(GraspError::OtherSize {
                view: input.name.to_owned(),
                what,
                width,
                height,
                expected_width,
                expected_height,
            });
        }
    }
    Ok(())
}
