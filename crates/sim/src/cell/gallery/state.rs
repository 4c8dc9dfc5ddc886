//! What is to be seen, and what is there of it.

use std::sync::Arc;
use std::time::{Duration, Instant};

use geometry::RigidTransform;

use super::job::Job;
use super::layout::{Layout, is_as_seen};
use super::wall::{Shown, Wall};
use super::{Binning, Exhibit, Scenery, Sight};
use crate::SimError;
use crate::scene::View;
use crate::world::{Mount, World};

/// An arm that is moved by hand is looked at when it has been still for so long.
const STILL: Duration = Duration::from_millis(100);

#[derive(Debug)]
pub(super) struct State {
    /// As it was given.
    pub(super) world: Arc<World>,
    /// Of the world.
    pub(super) number: u64,
    pub(super) base_from_flange: RigidTransform,
    pub(super) layout: Arc<Layout>,
    /// When the cup has let go.
    pub(super) expected: Option<Arc<Layout>>,
    pub(super) cameras: Vec<Wall>,
    /// Views rendered so far.
    pub(super) rendered: u64,
    pub(super) ended: bool,
}

impl State {
    /// After another world came.
    pub(super) fn show_anew(&mut self, old: &World, is_seen_anew: bool) {
        let (world, scene) = (Arc::clone(&self.world), self.layout.scene);
        for ((wall, camera), old_camera) in self.cameras.iter_mut().zip(&world.cameras).zip(&old.cameras) {
            wall.still_at = Instant::now();
            wall.failure = None;
            wall.keep_scene(scene);
            // Noise begins anew even where the view stays: it belongs to the world.
            if is_seen_anew || world.seed != old.seed || camera != old_camera {
                wall.series += 1;
            }
        }
    }

    /// True where something has changed that can be seen.
    pub(super) fn show(&mut self, scenery: Scenery, now: Instant) -> bool {
        let scene = self.layout.scene;
        let layout = |places| Arc::new(Layout { scene, places });
        let is_held = scenery.expected.is_some();
        let expected = scenery.expected.map(layout);
        let is_expected = expected != self.expected;
        if is_expected {
            self.expected = expected;
        }
        let has_moved = self.move_flange_until(scenery.base_from_flange, now + scenery.still);
        let places = layout(scenery.places);
        if places.is_as_seen(&self.layout) {
            return has_moved || is_expected;
        }
        self.layout = places;
        let still_at = if is_held { now + scenery.still } else { now };
        for (wall, camera) in self.cameras.iter_mut().zip(&self.world.cameras) {
            // One that moves is still later.
            let is_fixed = matches!(camera.mount, Mount::Table { .. });
            wall.still_at = if is_fixed {
                still_at
            } else {
                wall.still_at.max(still_at)
            };
            wall.failure = None;
        }
        true
    }

    pub(super) fn move_flange(&mut self, base_from_flange: RigidTransform, now: Instant) -> bool {
        self.move_flange_until(base_from_flange, now + STILL)
    }

    fn move_flange_until(&mut self, base_from_flange: RigidTransform, still_at: Instant) -> bool {
        if is_as_seen(&self.base_from_flange, &base_from_flange) {
            return false;
        }
        self.base_from_flange = base_from_flange;
        for (wall, camera) in self.cameras.iter_mut().zip(&self.world.cameras) {
            if matches!(camera.mount, Mount::Flange { .. }) {
                wall.still_at = still_at;
                wall.failure = None;
            }
        }
        true
    }

    fn base_from_camera(&self, camera: usize) -> RigidTransform {
        self.world.cameras[camera]
            .mount
            .base_from_camera(&self.base_from_flange)
    }

    /// Of the cameras as they stand now.
    pub(super) fn view(&self, camera: usize, binning: Binning) -> Result<View, SimError> {
        let lens = self.world.cameras[camera].binned_lens(binning)?;
        Ok(View {
            camera: lens,
            base_from_camera: self.base_from_camera(camera),
        })
    }

    /// What a camera will see where it will be: one that is fixed, or where it gave frames.
    pub(super) fn expected_view(&self, camera: usize, binning: Binning) -> Option<(View, &Arc<Layout>)> {
        let mut view = self.view(camera, binning).ok()?;
        if let Mount::Flange { .. } = self.world.cameras[camera].mount {
            view.base_from_camera = self.cameras[camera].taken_from?;
        }
        Some((view, self.expected.as_ref().unwrap_or(&self.layout)))
    }

    /// Or where nobody has said yet where that is.
    pub(super) fn is_where_frames_are_taken(&self, camera: usize) -> bool {
        let taken_from = self.cameras[camera].taken_from;
        taken_from.is_none_or(|there| is_as_seen(&there, &self.base_from_camera(camera)))
    }

    pub(super) fn exhibit(&self, camera: usize, binning: Binning) -> Option<Exhibit> {
        let view = self.view(camera, binning).ok()?;
        let shown = self.cameras[camera].find(&view, &self.layout)?;
        Some(self.exhibit_of(camera, shown))
    }

    pub(super) fn exhibit_of(&self, camera: usize, shown: &Shown) -> Exhibit {
        Exhibit {
            sight: Arc::clone(&shown.sight),
            world: Arc::clone(&self.world),
            edition: shown.number,
            series: self.cameras[camera].series,
        }
    }

    /// Shows what was rendered, unless its scene is no more.
    pub(super) fn hang(&mut self, job: &Job, outcome: Result<Sight, SimError>) {
        if job.layout.scene != self.layout.scene {
            return;
        }
        match outcome {
            Ok(sight) => self.hang_sight(job, sight),
            Err(error) => {
                tracing::error!("camera {}: {error}", job.camera + 1);
                self.cameras[job.camera].failure = Some(error.to_string());
            }
        }
    }

    fn hang_sight(&mut self, job: &Job, sight: Sight) {
        self.rendered += 1;
        let shown = Shown {
            number: self.rendered,
            layout: Arc::clone(&job.layout),
            sight: Arc::new(sight),
        };
        let wanted = self.cameras[job.camera].wanted;
        let now = self
            .view(job.camera, wanted)
            .map(|view| (view, Arc::clone(&self.layout)));
        let later = self.expected_view(job.camera, wanted);
        let later = later.map(|(view, layout)| (view, Arc::clone(layout)));
        let needed: Vec<_> = now.into_iter().chain(later).collect();
        let is_needed = |shown: &Shown| needed.iter().any(|(view, layout)| shown.is_of(view, layout));
        self.cameras[job.camera].hang(shown, is_needed);
    }

    pub(super) fn not_rendered(&self, camera: usize, waited: Duration, reason: String) -> SimError {
        SimError::NotRendered {
            camera: self.world.cameras[camera].name.clone(),
            waited,
            reason,
        }
    }
}
