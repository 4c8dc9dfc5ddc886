//! The whole cell over its wires: the real firmware steps the lights, the cameras expose and send.

mod arm;
mod camera;
mod controller;
mod objects;

use std::path::Path;
use std::time::Duration;

use camera::{Camera, Frame};
use controller::Controller;
use geometry::RigidTransform;
use geometry::nalgebra::{Matrix3, Point3, UnitQuaternion, Vector2, Vector3};
use gige_vision::{Faults, Register};
use light_protocol::Panels;
use sim::SimError;
use sim::board::BoardError;
use sim::cell::{Cell, CellOptions, Sight};
use sim::world::World;

/// Far beyond what anything here takes.
const PATIENCE: Duration = Duration::from_secs(20);
const EXPOSURE: Duration = Duration::from_micros(2500);

/// A white hemisphere in the middle of the mat, seen by small sensors.
const HEMISPHERE: &str = "
seed: 11
cameras: {c1: {width: 80, height: 80}, c2: {width: 80, height: 80}}
objects: [{name: ball, shape: {kind: hemisphere, radius: 0.03, segments: 64}}]
";

fn world(more: &str) -> World {
    World::from_yaml(&format!("{HEMISPHERE}{more}"), Path::new("")).unwrap()
}

/// None, and a loud word, where the board's tools are not installed.
fn start(world: World) -> Option<Cell> {
    let options = CellOptions {
        control_port: 0,
        patience: PATIENCE,
        ..CellOptions::default()
    };
    match Cell::start(world, &options) {
        Ok(cell) => Some(cell),
        Err(SimError::Board(error @ BoardError::NotBuilt { .. })) => {
            println!("SKIPPED: {error} (cargo xtask setup)");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

fn open(cell: &Cell) -> [Camera; 2] {
    ["c1", "c2"].map(|name| Camera::open(cell.camera(name).unwrap(), EXPOSURE))
}

/// Eight frames of both cameras.
fn capture(cameras: &mut [Camera; 2], controller: &mut Controller) -> [Vec<Frame>; 2] {
    for camera in cameras.iter_mut() {
        camera.start();
    }
    controller.capture();
    let frames = cameras.each_mut().map(|camera| camera.frames(8));
    for camera in cameras.iter_mut() {
        camera.stop();
    }
    frames
}

fn mean(frame: &Frame) -> f64 {
    frame.pixels.iter().map(|pixel| f64::from(*pixel)).sum::<f64>() / frame.pixels.len() as f64
}

/// Towards a grazing panel, on the table.
fn azimuth(panel: usize) -> Vector2<f64> {
    let angle = (60.0 * panel as f64 - 30.0).to_radians();
    Vector2::new(angle.cos(), angle.sin())
}

/// Where light falls from on the ball, on the table: Lambert's law, fitted to the lit pixels.
fn lit_side(lit: &Frame, dark: &Frame, sight: &Sight) -> Vector2<f64> {
    let light = |index: usize| f64::from(lit.pixels[index]) - f64::from(dark.pixels[index]);
    let labels = sight.rendered.labels.pixels().iter();
    let ball: Vec<usize> = labels
        .enumerate()
        .filter(|(_, label)| **label == 1)
        .map(|(index, _)| index)
        .collect();
    let brightest = ball.iter().map(|index| light(*index)).fold(0.0, f64::max);
    let (mut normals, mut sum) = (Matrix3::zeros(), Vector3::zeros());
    for index in ball.into_iter().filter(|index| light(*index) > brightest / 5.0) {
        let normal = Vector3::from(sight.rendered.normals.pixels()[index]).cast::<f64>();
        normals += normal * normal.transpose();
        sum += normal * light(index);
    }
    normals
        .try_inverse()
        .map(|inverse| (inverse * sum).xy().normalize())
        .expect("a ball has normals of all directions")
}

/// Light on the mat around a place on it.
fn light_at(place: Vector2<f64>, lit: &Frame, dark: &Frame, sight: &Sight) -> f64 {
    let point = Point3::new(0.43 + place.x, place.y, 0.0);
    let camera_from_base = sight.view.base_from_camera.inverse();
    let pixel = sight
        .view
        .camera
        .project(&camera_from_base.transform_point(&point))
        .unwrap();
    let (x, y) = (pixel.x.round() as usize, pixel.y.round() as usize);
    let around = (y - 2..=y + 2).flat_map(|y| (x - 2..=x + 2).map(move |x| y * lit.width + x));
    around
        .map(|index| f64::from(lit.pixels[index]) - f64::from(dark.pixels[index]))
        .sum()
}

#[test]
fn the_lit_side_turns_with_the_light_and_shadows_fall_away_from_it() {
    let Some(cell) = start(world("")) else { return };
    let mut controller = Controller::open(cell.board().port());
    let mut cameras = open(&cell);
    cell.wait_until_rendered(PATIENCE).unwrap();
    let captures = capture(&mut cameras, &mut controller);
    for (name, frames) in ["c1", "c2"].into_iter().zip(&captures) {
        let sight = cell.sight(name).unwrap();
        let dark = &frames[0];
        for (panel, frame) in frames.iter().enumerate().take(7).skip(1) {
            let towards = azimuth(panel);
            let lit = lit_side(frame, dark, &sight);
            assert!(lit.dot(&towards) > 0.95, "{name}, L{panel}: the lit side is at {lit}");
            let near = light_at(towards * 0.045, frame, dark, &sight);
            let far = light_at(towards * -0.045, frame, dark, &sight);
            assert!(
                far < near / 4.0,
                "{name}, L{panel}: {near} before the ball, {far} behind it"
            );
        }
        assert!(mean(&frames[7]) > 2.0 * mean(dark), "{name}: L7 shines");
        let brightest = frames.iter().flat_map(|frame| &frame.pixels).max().unwrap();
        assert!(
            (45_000..60_000).contains(brightest),
            "{name}: the brightest pixel is {brightest}"
        );
    }
    let sent = ["c1", "c2"].map(|name| cell.camera(name).unwrap().counters().frames_sent);
    assert_eq!(sent, [8, 8]);
}

#[test]
fn a_dead_panel_is_dark_and_swapped_ones_shine_for_each_other() {
    let Some(cell) = start(world("lights: {dead: [3], swapped: [[1, 4]]}")) else {
        return;
    };
    let mut controller = Controller::open(cell.board().port());
    let mut cameras = open(&cell);
    cell.wait_until_rendered(PATIENCE).unwrap();
    let captures = capture(&mut cameras, &mut controller);
    for (name, frames) in ["c1", "c2"].into_iter().zip(&captures) {
        let sight = cell.sight(name).unwrap();
        let (dark, dead) = (mean(&frames[0]), mean(&frames[3]));
        assert!(
            (dead / dark - 1.0).abs() < 0.02,
            "{name}: {dead} with the dead panel, {dark} in the dark"
        );
        for (output, panel) in [(1, 4), (4, 1), (2, 2)] {
            let lit = lit_side(&frames[output], &frames[0], &sight);
            assert!(lit.dot(&azimuth(panel)) > 0.95, "{name}: output {output} lights {lit}");
        }
    }
}

#[test]
fn the_same_world_gives_the_same_images_and_no_two_captures_the_same_noise() {
    let captures = || {
        let cell = start(world(""))?;
        let mut controller = Controller::open(cell.board().port());
        let mut cameras = open(&cell);
        cell.wait_until_rendered(PATIENCE).unwrap();
        Some([(); 2].map(|()| capture(&mut cameras, &mut controller)))
    };
    let (Some(first), Some(second)) = (captures(), captures()) else {
        return;
    };
    assert!(first == second, "two cells with the same world give other images");
    let [once, again] = &first;
    for (once, again) in once.iter().flatten().zip(again.iter().flatten()) {
        let alike = once.pixels.iter().zip(&again.pixels).filter(|(a, b)| a == b).count();
        assert!(alike < once.pixels.len() / 2, "{alike} pixels are alike");
        assert!((mean(once) / mean(again) - 1.0).abs() < 0.02, "the light is the same");
    }
}

#[test]
fn panels_that_shine_together_add_up() {
    let Some(cell) = start(world("")) else { return };
    let mut controller = Controller::open(cell.board().port());
    let [mut camera, _] = open(&cell);
    camera.start();
    let panel = |number| Panels::single(number).unwrap();
    controller.run(&[Panels::NONE, panel(2), panel(5), panel(2).with(panel(5))]);
    let [dark, two, five, both] = camera.frames(4).try_into().unwrap();
    let sum = mean(&two) + mean(&five) - mean(&dark);
    assert!((mean(&both) / sum - 1.0).abs() < 0.01, "{} and not {sum}", mean(&both));
}

#[test]
fn the_world_the_flange_and_the_binning_change_what_is_seen_next() {
    let Some(cell) = start(world("")) else { return };
    let mut controller = Controller::open(cell.board().port());
    let mut cameras = open(&cell);
    cell.wait_until_rendered(PATIENCE).unwrap();
    let [c1, c2] = [cell.sight("c1").unwrap(), cell.sight("c2").unwrap()];

    let flange = cell.world().base_from_flange;
    let shift = RigidTransform::from_parts(Vector3::new(0.0, 0.0, 0.05), UnitQuaternion::identity());
    cell.set_flange(shift * flange);
    cell.wait_until_rendered(PATIENCE).unwrap();
    let raised = cell.sight("c1").unwrap();
    let count = |sight: &Sight| {
        sight
            .rendered
            .labels
            .pixels()
            .iter()
            .map(|label| u32::from(*label))
            .sum::<u32>()
    };
    assert!(
        count(&raised) < count(&c1) * 4 / 5,
        "the ball is smaller from further up"
    );
    assert!(
        std::sync::Arc::ptr_eq(&c2, &cell.sight("c2").unwrap()),
        "C2 sees what it saw"
    );

    cameras[0].set(Register::BinningHorizontal, 2);
    cameras[0].set(Register::BinningVertical, 2);
    let [binned, whole] = capture(&mut cameras, &mut controller);
    assert_eq!((binned[1].width, binned[1].height, whole[1].width), (40, 40, 80));
    assert_eq!(
        cell.sight("c1").unwrap().rendered.ambient.width(),
        40,
        "rendered for the binned camera"
    );

    let mut empty = World::clone(&cell.world());
    empty.scene.bodies.clear();
    cell.set_world(empty).unwrap();
    let [_, without] = capture(&mut cameras, &mut controller);
    let brightest = |frame: &Frame| frame.pixels.iter().copied().max();
    let (with, without) = (brightest(&whole[1]), brightest(&without[1]));
    assert!(
        without < with.map(|with| with / 4),
        "the ball is gone: {without:?} of {with:?}"
    );
}

#[test]
fn a_region_is_the_part_of_the_image_that_it_says() {
    let Some(cell) = start(world("")) else { return };
    let mut controller = Controller::open(cell.board().port());
    let [mut camera, _] = open(&cell);
    camera.start();
    controller.run(&[Panels::single(1).unwrap()]);
    let whole = camera.frames(1).remove(0);
    camera.stop();
    for (register, value) in [
        (Register::Width, 32),
        (Register::Height, 16),
        (Register::OffsetX, 40),
        (Register::OffsetY, 44),
    ] {
        camera.set(register, value);
    }
    camera.start();
    controller.run(&[Panels::single(1).unwrap()]);
    let part = camera.frames(1).remove(0);
    assert_eq!((part.width, part.height), (32, 16));
    let (mut difference, mut light) = (0.0, 0.0);
    for (index, pixel) in part.pixels.iter().enumerate() {
        let there = whole.pixels[(44 + index / 32) * 80 + 40 + index % 32];
        difference += (f64::from(*pixel) - f64::from(there)).abs();
        light += f64::from(there);
    }
    assert!(difference < 0.05 * light, "{difference} of {light}");
}

#[test]
fn what_is_on_the_network_stays_as_long_as_the_cell_runs() {
    let Some(cell) = start(world("")) else { return };
    let mut other = World::clone(&cell.world());
    other.cameras[1].trigger_line = 1;
    other.scene.bodies.clear();
    let error = cell.set_world(other).unwrap_err().to_string();
    assert_eq!(
        error,
        "cameras.c2.trigger_line is 1; allowed is 2 as long as the cell runs"
    );
    assert_eq!(
        cell.world().scene.bodies.len(),
        1,
        "a world that is refused changes nothing"
    );
}

#[test]
fn a_camera_with_its_cable_pulled_out_says_nothing_and_the_other_goes_on() {
    let Some(cell) = start(world("")) else { return };
    let mut controller = Controller::open(cell.board().port());
    let mut cameras = open(&cell);
    cameras.iter_mut().for_each(Camera::start);
    cell.camera("c1").unwrap().set_faults(Faults {
        muted: true,
        ..Faults::default()
    });
    controller.capture();
    assert_eq!(cameras[1].frames(8).len(), 8);
    assert!(cameras[0].is_silent());
}
