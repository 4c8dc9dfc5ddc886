//! Depth edges: of a raised square with its shadows, of what must give none, and of a disc on a plate of the same print.

use std::path::{Path, PathBuf};

use calibration_files::LightsFile;
use geometry::nalgebra::{Point2, Point3, UnitQuaternion, Vector3};
use geometry::{PinholeCamera, RigidTransform};
use imaging::{ExposureStack, Image, Mask};
use photometric::{
    Capture, EdgeInput, EdgeMap, EdgeOptions, LightRig, ObjectMaskOptions, PhotometricError, PixelRays, SensorNoise,
    View, object_mask, occlusion_edges,
};
use rig_scenes::{CapturedView, SceneFolder};

const SIZE: usize = 200;
const OFFSET: u16 = 300;
const SATURATION: u16 = 65_520;
/// Half of the raised square's side and its height, metres.
const SQUARE: (f64, f64) = (0.015, 0.004);
/// Digital numbers for one unit of irradiance on albedo 1.
const GAIN: f64 = 1.2e6;

/// A camera straight above the middle of the mat, 3.5 pixels to the millimetre.
fn view(size: usize) -> View {
    let middle = (size as f64 - 1.0) / 2.0;
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    View {
        camera: PinholeCamera::new(size, size, [1050.0; 2], [middle; 2]).unwrap(),
        base_from_camera: RigidTransform::from_parts(Vector3::new(0.43, 0.0, 0.3), down),
    }
}

/// Where a pixel's ray meets the level plane at a height.
fn on_plane(view: &View, pixel: [f64; 2], height: f64) -> Point3<f64> {
    let ray = view.camera.unproject(&Point2::from(pixel)).unwrap();
    let ideal = [ray.x as f32, ray.y as f32];
    view.point_at_depth(ideal, view.depth_of_plane(ideal, height))
}

fn is_over_square(point: &Point3<f64>) -> bool {
    (point.x - 0.43).abs() < SQUARE.0 && point.y.abs() < SQUARE.0
}

/// Whether a point of the floor sees a light past the raised square.
fn sees(point: &Point3<f64>, light: &Point3<f64>) -> bool {
    let way = light - point;
    (0..=50).all(|step| !is_over_square(&(point + way * (SQUARE.1 / way.z * f64::from(step) / 50.0))))
}

/// Print of cells of two pixels with albedo 0.2 to 0.9.
fn print() -> impl Fn(usize, usize) -> f64 {
    let mut random = fastrand::Rng::with_seed(7);
    let cells: Vec<f64> = (0..SIZE * SIZE / 4).map(|_| 0.2 + 0.7 * random.f64()).collect();
    move |x, y| cells[y / 2 * (SIZE / 2) + x / 2]
}

/// Images with noise of the rig's sensor, from the irradiance of a pixel under a panel.
fn stack(size: usize, gain: f64, signal: impl Fn(&photometric::PanelModel, usize, usize) -> f64) -> ExposureStack {
    let rig = LightRig::nominal();
    let mut random = fastrand::Rng::with_seed(1);
    // The sum of twelve evenly spread numbers is nearly normal.
    let mut noise = |signal: f64| {
        let sigma = SensorNoise::RIG.difference_variance(signal as f32, 0.0).sqrt() / std::f32::consts::SQRT_2;
        ((0..12).map(|_| random.f64()).sum::<f64>() - 6.0) * f64::from(sigma)
    };
    let mut images = vec![(0, Image::filled(size, size, OFFSET))];
    for panel in rig.panels() {
        let raw = (0..size * size).map(|index| {
            let signal = gain * signal(panel, index % size, index / size);
            (f64::from(OFFSET) + signal + noise(signal)).clamp(0.0, 65_535.0) as u16
        });
        images.push((panel.channel, Image::new(size, size, raw.collect()).unwrap()));
    }
    ExposureStack::new(&rig.channels(), images, SATURATION).unwrap()
}

/// The raised square on a floor of the same print.
fn raised_square(gain: f64) -> ExposureStack {
    let (view, print) = (view(SIZE), print());
    stack(SIZE, gain, |panel, x, y| {
        let pixel = [x as f64, y as f64];
        let top = on_plane(&view, pixel, SQUARE.1);
        let floor = on_plane(&view, pixel, 0.0);
        let point = if is_over_square(&top) { top } else { floor };
        let is_lit = is_over_square(&top) || sees(&floor, &panel.rectangle.centre);
        let light = if is_lit {
            panel.direct(&point, &Vector3::z())
        } else {
            0.0
        };
        print(x, y) * (light + 0.001)
    })
}

fn edges(stack: &ExposureStack, rig: &LightRig, mask: Option<&Mask>) -> Result<EdgeMap, PhotometricError> {
    let view = view(stack.width());
    edges_of(stack, &view, rig, mask, &EdgeOptions::default())
}

fn edges_of(
    stack: &ExposureStack,
    view: &View,
    rig: &LightRig,
    mask: Option<&Mask>,
    options: &EdgeOptions,
) -> Result<EdgeMap, PhotometricError> {
    let rays = PixelRays::new(&view.camera);
    let capture = Capture {
        stack,
        view,
        rays: &rays,
        rig,
        noise: SensorNoise::RIG,
    };
    let input = EdgeInput {
        capture: &capture,
        mask,
        depth: None,
    };
    occlusion_edges(&input, options)
}

fn pixels(mask: &Mask) -> Vec<(usize, usize)> {
    let (width, height) = (mask.as_image().width(), mask.as_image().height());
    let all = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    all.filter(|&(x, y)| mask.contains(x, y)).collect()
}

fn is_near(mask: &Mask, (x, y): (usize, usize), radius: usize) -> bool {
    let around = |middle: usize| middle.saturating_sub(radius)..=middle + radius;
    around(y).any(|y| around(x).any(|x| mask.contains(x, y)))
}

/// Pixels of a set beside one that is not in it.
fn outline(mask: &Mask) -> Mask {
    let image = mask.as_image();
    Mask::from_nonzero(&Image::from_fn(image.width(), image.height(), |x, y| {
        let beside = [(x + 1, y), (x.wrapping_sub(1), y), (x, y + 1), (x, y.wrapping_sub(1))];
        u8::from(mask.contains(x, y) && beside.iter().any(|&(x, y)| !mask.contains(x, y)))
    }))
}

/// Share of `wanted` within two pixels of an edge.
fn covered(wanted: &Mask, edges: &Mask) -> f64 {
    let pixels = pixels(wanted);
    pixels.iter().filter(|&&pixel| is_near(edges, pixel, 2)).count() as f64 / pixels.len() as f64
}

fn square_outline() -> Mask {
    let view = view(SIZE);
    let top = |x: usize, y: usize| is_over_square(&on_plane(&view, [x as f64, y as f64], SQUARE.1));
    outline(&Mask::from_nonzero(&Image::from_fn(SIZE, SIZE, |x, y| {
        u8::from(top(x, y))
    })))
}

/// Edges further than a radius from the square's outline; at its corners, where sides of shadows begin, further than
/// two reaches.
fn strays(edges: &Mask, outline: &Mask, radius: usize) -> Vec<(usize, usize)> {
    let corners = [(47, 47), (47, 152), (152, 47), (152, 152)];
    let allowed = |&(x, y): &(usize, usize)| {
        let is_corner = corners
            .iter()
            .any(|&(u, v): &(usize, usize)| x.abs_diff(u) <= 12 && y.abs_diff(v) <= 12);
        if is_corner { 8 } else { radius }
    };
    let edges = pixels(edges).into_iter();
    edges
        .filter(|pixel| !is_near(outline, *pixel, allowed(pixel)))
        .collect()
}

#[test]
fn a_raised_square_of_its_floors_print_has_its_outline_for_edges() {
    let found = edges(&raised_square(GAIN), &LightRig::nominal(), None).unwrap();
    let outline = square_outline();
    assert!(
        covered(&outline, &found.edges) > 0.98,
        "{}",
        covered(&outline, &found.edges)
    );
    // Shadows end where nothing hides anything.
    assert_eq!(strays(&found.edges, &outline, 3), []);
    // Bridged gaps and the ends of lines may have none.
    let confidence = |&(x, y): &(usize, usize)| *found.confidence.get(x, y).unwrap();
    let pixels = pixels(&found.edges);
    let sure = pixels.iter().filter(|pixel| confidence(pixel) > 0.15).count();
    assert!(sure * 20 > pixels.len() * 19, "{sure} of {}", pixels.len());
    assert!(found.confidence.pixels().iter().all(|c| (0.0..=1.0).contains(c)));
    assert_eq!(found.lights, [1, 2, 3, 4, 5, 6]);
}

#[test]
fn a_square_in_half_the_light_keeps_its_outline() {
    let found = edges(&raised_square(GAIN / 2.0), &LightRig::nominal(), None).unwrap();
    assert!(covered(&square_outline(), &found.edges) > 0.98);
}

#[test]
fn print_alone_gives_no_edges() {
    let (view, print) = (view(SIZE), print());
    let level = stack(SIZE, GAIN, |panel, x, y| {
        print(x, y) * panel.irradiance(&on_plane(&view, [x as f64, y as f64], 0.0), &Vector3::z())
    });
    assert_eq!(edges(&level, &LightRig::nominal(), None).unwrap().edges.count(), 0);
}

#[test]
fn creases_alone_give_no_edges() {
    let view = view(SIZE);
    // Roofs and valleys of 20 to 50 degrees, along the panels' azimuths and across them; attached shadows only.
    for (slope, azimuth) in
        [(20.0, 30.0), (35.0, 0.0), (50.0, 75.0_f64)].map(|(a, b)| (f64::to_radians(a), b.to_radians()))
    {
        let across = Vector3::new(azimuth.cos(), azimuth.sin(), 0.0);
        for side in [1.0, -1.0] {
            let roof = stack(SIZE, GAIN / 3.0, |panel, x, y| {
                let point = on_plane(&view, [x as f64, y as f64], 0.015);
                let lean = side * (point - Point3::new(0.43, 0.0, 0.015)).dot(&across).signum();
                let normal = across * (lean * slope.sin()) + Vector3::z() * slope.cos();
                0.8 * (panel.irradiance(&point, &normal) + 0.001)
            });
            let count = edges(&roof, &LightRig::nominal(), None).unwrap().edges.count();
            assert_eq!(count, 0, "slope {slope}, azimuth {azimuth}, side {side}");
        }
    }
}

#[test]
fn the_dark_one_pixel_and_white_give_no_edges() {
    let (rig, dark) = (LightRig::nominal(), stack(SIZE, 0.0, |_, _, _| 0.0));
    let found = edges(&dark, &rig, None).unwrap();
    assert_eq!(found.edges.count(), 0);
    assert!(found.confidence.pixels().iter().all(|&c| c == 0.0), "noise is no edge");
    assert_eq!(
        edges(&stack(1, GAIN, |_, _, _| 0.5), &rig, None).unwrap().edges.count(),
        0
    );
    let white = stack(SIZE, 1e9, |_, _, _| 1.0);
    assert_eq!(edges(&white, &rig, None).unwrap().edges.count(), 0);
}

#[test]
fn saturated_cells_move_edges_by_less_than_the_reach() {
    let found = edges(&raised_square(GAIN * 2.0), &LightRig::nominal(), None).unwrap();
    let outline = square_outline();
    assert_eq!(strays(&found.edges, &outline, 5), []);
    assert!(
        covered(&outline, &found.edges) > 0.5,
        "{}",
        covered(&outline, &found.edges)
    );
}

#[test]
fn edges_stay_in_the_mask() {
    let (stack, rig) = (raised_square(GAIN), LightRig::nominal());
    let all = Mask::from_nonzero(&Image::filled(SIZE, SIZE, 1_u8));
    let everywhere = edges(&stack, &rig, None).unwrap();
    assert_eq!(edges(&stack, &rig, Some(&all)).unwrap(), everywhere);
    let left = Mask::from_nonzero(&Image::from_fn(SIZE, SIZE, |x, _| u8::from(x < SIZE / 2)));
    let found = edges(&stack, &rig, Some(&left)).unwrap();
    let expected = pixels(&everywhere.edges).into_iter().filter(|&(x, _)| x < SIZE / 2 + 2);
    assert_eq!(pixels(&found.edges), expected.collect::<Vec<_>>());
}

#[test]
fn one_thread_and_two_find_the_same() {
    let (stack, rig) = (raised_square(GAIN), LightRig::nominal());
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| edges(&stack, &rig, None).unwrap())
    };
    assert_eq!(with(1), with(2));
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    let (stack, rig, view) = (raised_square(GAIN), LightRig::nominal(), view(SIZE));
    let refusal = |rig: &LightRig, mask: Option<&Mask>, options: EdgeOptions| {
        edges_of(&stack, &view, rig, mask, &options).unwrap_err().to_string()
    };
    let default = EdgeOptions::default();
    let other = Mask::from_nonzero(&Image::filled(SIZE, 3, 1_u8));
    assert!(refusal(&rig, Some(&other), default).contains("the mask are 200 x 3"));
    let three = LightRig::new(rig.panels()[..3].to_vec()).unwrap();
    assert!(refusal(&three, None, default).contains("[1, 2, 3]"));
    let mut panels = rig.panels().to_vec();
    panels[6].channel = 9;
    assert!(refusal(&LightRig::new(panels).unwrap(), None, default).contains("channel 9"));
    for (options, what) in [
        (
            EdgeOptions {
                reach: f64::NAN,
                ..default
            },
            "reach",
        ),
        (EdgeOptions { height: 7.0, ..default }, "height"),
        (EdgeOptions { strong: 1.5, ..default }, "strong"),
        (EdgeOptions { weak: -0.1, ..default }, "weak"),
        (EdgeOptions { weak: 0.5, ..default }, "strong - weak"),
    ] {
        let text = refusal(&rig, None, options);
        assert!(text.starts_with(what), "{text}");
    }
}

fn scene(name: &str) -> Option<(Vec<CapturedView>, LightRig)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let folder: PathBuf = root.join("../shared/data/rig/objects").join(name);
    if !folder.exists() {
        println!("SKIPPED: {} is missing", folder.display());
        return None;
    }
    let lights = LightsFile::read(&root.join("launch_configs/calibration/lights.yaml")).unwrap();
    Some((
        SceneFolder::open(&folder).unwrap().views().unwrap(),
        lights.rig().unwrap(),
    ))
}

/// Edges in the object that the capture itself shows.
fn scene_edges(captured: &CapturedView, rig: &LightRig) -> EdgeMap {
    let rays = PixelRays::new(&captured.view.camera);
    let capture = Capture {
        stack: &captured.stack,
        view: &captured.view,
        rays: &rays,
        rig,
        noise: SensorNoise::RIG,
    };
    let mask = object_mask(&capture, &ObjectMaskOptions::default()).unwrap();
    edges_of(
        &captured.stack,
        &captured.view,
        rig,
        Some(&mask),
        &EdgeOptions::default(),
    )
    .unwrap()
}

fn middle(mask: &Mask) -> (usize, usize) {
    let pixels = pixels(mask);
    let mean = |sum: usize| sum / pixels.len();
    let (x, y) = (pixels.iter().map(|p| p.0).sum(), pixels.iter().map(|p| p.1).sum());
    (mean(x), mean(y))
}

/// Whether no way over neighbouring pixels leads from a pixel to the image's border without crossing an edge.
fn is_enclosed(edges: &Mask, start: (usize, usize)) -> bool {
    let (width, height) = (edges.as_image().width(), edges.as_image().height());
    let mut seen = vec![false; width * height];
    let mut next = vec![start];
    while let Some((x, y)) = next.pop() {
        if edges.contains(x, y) || std::mem::replace(&mut seen[y * width + x], true) {
            continue;
        }
        if x == 0 || y == 0 || x + 1 == width || y + 1 == height {
            return false;
        }
        next.extend([(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)]);
    }
    true
}

#[test]
fn a_disc_on_a_plate_of_its_own_print_is_a_closed_ring() {
    let Some((views, rig)) = scene("disc") else { return };
    for captured in &views {
        let found = scene_edges(captured, &rig);
        let outline = outline(&captured.mask);
        let share = covered(&outline, &found.edges);
        let inside = pixels(&found.edges)
            .into_iter()
            .filter(|&(x, y)| captured.mask.contains(x, y) && !is_near(&outline, (x, y), 3));
        let inside = inside.count();
        println!(
            "disc {}: {:.1} % of the outline, {inside} edge pixels inside",
            captured.camera,
            100.0 * share
        );
        assert!(share >= 0.95, "{}: {share}", captured.camera);
        assert!(
            is_enclosed(&found.edges, middle(&captured.mask)),
            "{}: the ring is open",
            captured.camera
        );
        assert!(inside <= 5, "{}: {inside}", captured.camera);
    }
}

#[test]
fn a_pyramid_has_creases_only() {
    let Some((views, rig)) = scene("pyramid") else { return };
    for captured in &views {
        let outline = outline(&captured.mask);
        let found = scene_edges(captured, &rig);
        let inside = pixels(&found.edges)
            .into_iter()
            .filter(|&pixel| !is_near(&outline, pixel, 3));
        assert_eq!(inside.count(), 0, "{}", captured.camera);
    }
}

/// The part of the outline beyond which the table lies deeper: not where a wall that is seen meets it.
fn high_outline(captured: &CapturedView) -> Mask {
    let depth = &captured.truth.as_ref().unwrap().depth;
    let outline = outline(&captured.mask);
    let is_deeper = |x: usize, y: usize| {
        let around = [(x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)];
        let off = around.into_iter().filter(|&(x, y)| !captured.mask.contains(x, y));
        off.into_iter().any(|(u, v)| depth.row(v)[u] - depth.row(y)[x] > 0.0015)
    };
    let pick = |x: usize, y: usize| u8::from(outline.contains(x, y) && is_deeper(x, y));
    Mask::from_nonzero(&Image::from_fn(depth.width(), depth.height(), pick))
}

#[test]
fn a_white_plate_on_the_dark_mat_has_its_outline_for_edges() {
    let Some((views, rig)) = scene("plate_flat") else {
        return;
    };
    for captured in &views {
        let found = scene_edges(captured, &rig);
        let wanted = high_outline(captured);
        let share = covered(&wanted, &found.edges);
        let count = wanted.count();
        println!("plate {}: {:.1} % of {count} pixels", captured.camera, 100.0 * share);
        assert!(count > 300 && share >= 0.98, "{}: {share} of {count}", captured.camera);
    }
}
