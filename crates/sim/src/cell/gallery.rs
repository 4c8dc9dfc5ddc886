//! What the cameras see: rendered by a thread of its own whenever that changes, kept until it changes again.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::{Condvar, Mutex, MutexGuard};

use crate::SimError;
use crate::render::{RenderOptions, RenderedView, render};
use crate::scene::View;
use crate::world::World;

/// Columns and rows averaged into one.
pub(super) type Binning = [u32; 2];

/// An arm that moves is not followed step by step: it is looked at when it has been still for so long, or when a frame
/// is wanted.
const STILL: Duration = Duration::from_millis(100);
/// An arm that is held trembles by less, metres and radians; no pixel shows it.
const UNSEEN: [f64; 2] = [2e-6, 5e-6];

/// A rendered view.
#[derive(Debug, Clone, PartialEq)]
pub struct Sight {
    /// From where it is seen, and with what lens.
    pub view: View,
    /// Radiance, and what is there.
    pub rendered: RenderedView,
    /// How long the rendering took.
    pub took: Duration,
}

/// A view, and the world that it belongs to.
#[derive(Debug, Clone)]
pub(super) struct Exhibit {
    pub(super) sight: Arc<Sight>,
    pub(super) world: Arc<World>,
    /// Rises with every change of the world or of this camera's place.
    pub(super) edition: u64,
}

#[derive(Debug)]
pub(super) struct Gallery {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug)]
struct State {
    world: Arc<World>,
    edition: u64,
    cameras: Vec<Wall>,
    ended: bool,
}

/// What is there of a camera.
#[derive(Debug)]
struct Wall {
    /// The binning that will be asked for.
    wanted: Binning,
    sights: HashMap<Binning, Arc<Sight>>,
    /// Binnings that frames wait for.
    awaited: Vec<Binning>,
    edition: u64,
    /// Not to be rendered before.
    still_at: Instant,
    /// Why the last attempt failed.
    failure: Option<String>,
}

/// Something to render.
struct Job {
    camera: usize,
    binning: Binning,
    edition: u64,
    world: Arc<World>,
}

impl Gallery {
    pub(super) fn new(world: World) -> Self {
        let wall = |binning: u32| Wall {
            wanted: [binning; 2],
            sights: HashMap::new(),
            awaited: Vec::new(),
            edition: 0,
            still_at: Instant::now(),
            failure: None,
        };
        let cameras = world.cameras.iter().map(|camera| wall(camera.binning)).collect();
        Self {
            state: Mutex::new(State {
                world: Arc::new(world),
                edition: 0,
                cameras,
                ended: false,
            }),
            changed: Condvar::new(),
        }
    }

    pub(super) fn world(&self) -> Arc<World> {
        Arc::clone(&self.state.lock().world)
    }

    /// Another world; views that do not change by it stay.
    pub(super) fn set_world(&self, world: World) {
        let mut state = self.state.lock();
        let old = std::mem::replace(&mut state.world, Arc::new(world));
        let seen_anew = state.world.scene != old.scene;
        state.show_anew(&old, seen_anew, Instant::now());
        self.changed.notify_all();
    }

    /// The arm moved; cameras that it does not carry see what they saw.
    pub(super) fn set_flange(&self, base_from_flange: geometry::RigidTransform) {
        let mut state = self.state.lock();
        if is_as_seen(&state.world.base_from_flange, &base_from_flange) {
            return;
        }
        let old = Arc::clone(&state.world);
        Arc::make_mut(&mut state.world).base_from_flange = base_from_flange;
        state.show_anew(&old, false, Instant::now() + STILL);
        self.changed.notify_all();
    }

    /// A client will probably ask for this.
    pub(super) fn want(&self, camera: usize, binning: Binning) {
        let mut state = self.state.lock();
        if state.cameras[camera].wanted != binning {
            state.cameras[camera].wanted = binning;
            self.changed.notify_all();
        }
    }

    /// What is there of the binning that is wanted.
    pub(super) fn current(&self, camera: usize) -> Option<Exhibit> {
        let state = self.state.lock();
        state.exhibit(camera, state.cameras[camera].wanted)
    }

    /// What is there of a binning.
    pub(super) fn of_binning(&self, camera: usize, binning: Binning) -> Option<Exhibit> {
        self.state.lock().exhibit(camera, binning)
    }

    /// Whether there is something of the binning that is wanted; fails when there will not be.
    pub(super) fn is_rendered(&self, camera: usize) -> Result<bool, SimError> {
        let state = self.state.lock();
        let wall = &state.cameras[camera];
        match &wall.failure {
            Some(reason) => Err(state.not_rendered(camera, Duration::ZERO, reason.clone())),
            None => Ok(wall.sights.contains_key(&wall.wanted)),
        }
    }

    /// The view at the binning that is wanted.
    pub(super) fn wait_for_wanted(&self, camera: usize, patience: Duration) -> Result<Exhibit, SimError> {
        let wanted = self.state.lock().cameras[camera].wanted;
        self.wait_for(camera, wanted, patience)
    }

    /// The view as the world is now, as soon as it is rendered.
    pub(super) fn wait_for(&self, camera: usize, binning: Binning, patience: Duration) -> Result<Exhibit, SimError> {
        let (start, mut state) = (Instant::now(), self.state.lock());
        state.cameras[camera].awaited.push(binning);
        self.changed.notify_all();
        let outcome = self.wait_locked(&mut state, camera, binning, start, patience);
        let awaited = &mut state.cameras[camera].awaited;
        if let Some(index) = awaited.iter().position(|awaited| *awaited == binning) {
            awaited.swap_remove(index);
        }
        outcome
    }

    fn wait_locked(
        &self,
        state: &mut MutexGuard<'_, State>,
        camera: usize,
        binning: Binning,
        start: Instant,
        patience: Duration,
    ) -> Result<Exhibit, SimError> {
        loop {
            if let Some(exhibit) = state.exhibit(camera, binning) {
                return Ok(exhibit);
            }
            let late = self.changed.wait_until(state, start + patience).timed_out();
            let failure = state.cameras[camera].failure.clone();
            if late || state.ended || failure.is_some() {
                let reason = failure.unwrap_or_else(|| "it is still at work".to_owned());
                return Err(state.not_rendered(camera, start.elapsed(), reason));
            }
        }
    }

    /// Every waiting ends.
    pub(super) fn end(&self) {
        self.state.lock().ended = true;
        self.changed.notify_all();
    }

    /// Renders until the end.
    pub(super) fn run(&self) {
        while let Some(job) = self.next_job() {
            let outcome = job.render();
            let mut state = self.state.lock();
            let wall = &mut state.cameras[job.camera];
            // A view of a world that is no more is nobody's.
            if wall.edition == job.edition {
                match outcome {
                    Ok(sight) => drop(wall.sights.insert(job.binning, Arc::new(sight))),
                    Err(error) => {
                        tracing::error!("camera {}: {error}", job.camera + 1);
                        wall.failure = Some(error.to_string());
                    }
                }
            }
            self.changed.notify_all();
        }
    }

    fn next_job(&self) -> Option<Job> {
        let mut state = self.state.lock();
        while !state.ended {
            let now = Instant::now();
            if let Some(job) = state.next_job(now) {
                return Some(job);
            }
            let moving = state.cameras.iter().map(|wall| wall.still_at).filter(|at| *at > now);
            match moving.min() {
                Some(at) => drop(self.changed.wait_until(&mut state, at)),
                None => self.changed.wait(&mut state),
            }
        }
        None
    }
}

impl State {
    /// After a change of the world: takes down what is not seen any more.
    fn show_anew(&mut self, old: &World, all: bool, still_at: Instant) {
        self.edition += 1;
        let world = &self.world;
        for ((wall, camera), old_camera) in self.cameras.iter_mut().zip(&world.cameras).zip(&old.cameras) {
            let moved = world.base_from_camera(camera) != old.base_from_camera(old_camera);
            if all || moved || camera.lens != old_camera.lens {
                wall.sights.clear();
                wall.still_at = still_at;
                wall.failure = None;
            }
            // Noise begins anew even where the view stays: it belongs to the world.
            if all || moved || world.seed != old.seed || camera != old_camera {
                wall.edition = self.edition;
            }
        }
    }

    fn not_rendered(&self, camera: usize, waited: Duration, reason: String) -> SimError {
        SimError::NotRendered {
            camera: self.world.cameras[camera].name.clone(),
            waited,
            reason,
        }
    }

    fn exhibit(&self, camera: usize, binning: Binning) -> Option<Exhibit> {
        let wall = &self.cameras[camera];
        Some(Exhibit {
            sight: Arc::clone(wall.sights.get(&binning)?),
            world: Arc::clone(&self.world),
            edition: wall.edition,
        })
    }

    fn next_job(&self, now: Instant) -> Option<Job> {
        let missing = |wall: &Wall, binning: &Binning| !wall.sights.contains_key(binning);
        let awaited = |wall: &Wall| wall.awaited.iter().copied().find(|binning| missing(wall, binning));
        let wanted = |wall: &Wall| (wall.still_at <= now && missing(wall, &wall.wanted)).then_some(wall.wanted);
        let open = || {
            self.cameras
                .iter()
                .enumerate()
                .filter(|(_, wall)| wall.failure.is_none())
        };
        let first = open().find_map(|(camera, wall)| Some((camera, awaited(wall)?)));
        let (camera, binning) = first.or_else(|| open().find_map(|(camera, wall)| Some((camera, wanted(wall)?))))?;
        Some(Job {
            camera,
            binning,
            edition: self.cameras[camera].edition,
            world: Arc::clone(&self.world),
        })
    }
}

impl Job {
    fn render(&self) -> Result<Sight, SimError> {
        let start = Instant::now();
        let view = self.world.view(&self.world.cameras[self.camera], self.binning)?;
        // The renderer's own noise does not follow the sensors' seed: a world seen twice is seen alike.
        let rendered = render(&self.world.scene, &view, &RenderOptions::default())?;
        Ok(Sight {
            view,
            rendered,
            took: start.elapsed(),
        })
    }
}

fn is_as_seen(shown: &geometry::RigidTransform, now: &geometry::RigidTransform) -> bool {
    let off = shown.inverse() * *now;
    off.translation().norm() < UNSEEN[0] && off.rotation().angle() < UNSEEN[1]
}
