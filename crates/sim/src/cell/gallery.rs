//! What the cameras see: rendered by a thread of its own, kept while it may be seen again.
//!
//! A view is where a camera stands and where the bodies are. The camera on the arm comes back to where frames were taken:
//! what it will see there is rendered ahead as soon as it is known, while the arm is still under way.

use std::sync::Arc;
use std::time::{Duration, Instant};

use geometry::RigidTransform;
use parking_lot::{Condvar, Mutex, MutexGuard};

use crate::SimError;
use crate::render::RenderedView;
use crate::scene::View;
use crate::world::World;
use job::{Ahead, Job};
use layout::Layout;
use state::State;
use wall::Wall;

mod job;
mod layout;
mod state;
mod wall;

pub(super) use layout::Places;

/// Columns and rows averaged into one.
pub(super) type Binning = [u32; 2];

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
    /// Cameras, lights and seed; what the objects do is in the sight.
    pub(super) world: Arc<World>,
    /// Of the sight: no other has it.
    pub(super) edition: u64,
    /// Rises with every change of the world that is not the arm's: noise begins anew with it.
    pub(super) series: u64,
}

/// What the arm does to the world.
#[derive(Debug, Clone)]
pub(super) struct Scenery {
    /// Of the world that it belongs to; of another it is nothing.
    pub(super) number: u64,
    pub(super) base_from_flange: RigidTransform,
    pub(super) places: Places,
    /// Where the bodies will be when the cup has let go; none: it holds nothing.
    pub(super) expected: Option<Places>,
    /// What moves is not followed step by step: it is looked at when it has been still for so long, or when a frame is
    /// wanted.
    pub(super) still: Duration,
}

#[derive(Debug)]
pub(super) struct Gallery {
    state: Mutex<State>,
    changed: Condvar,
}

impl Gallery {
    pub(super) fn new(world: World, places: Places) -> Self {
        let cameras = world.cameras.iter().map(|camera| Wall::new(camera.binning));
        Self {
            state: Mutex::new(State {
                base_from_flange: world.base_from_flange,
                number: 0,
                layout: Arc::new(Layout { scene: 0, places }),
                expected: None,
                cameras: cameras.collect(),
                world: Arc::new(world),
                rendered: 0,
                ended: false,
            }),
            changed: Condvar::new(),
        }
    }

    /// As it is now.
    pub(super) fn world(&self) -> Arc<World> {
        let (world, layout, base_from_flange) = {
            let state = self.state.lock();
            (
                Arc::clone(&state.world),
                Arc::clone(&state.layout),
                state.base_from_flange,
            )
        };
        Arc::new(World {
            scene: layout.scene(&world),
            base_from_flange,
            ..World::clone(&world)
        })
    }

    /// Another world, with its objects there; views that do not change by it stay.
    pub(super) fn set_world(&self, world: World, number: u64, places: Places) {
        let mut state = self.state.lock();
        let old = std::mem::replace(&mut state.world, Arc::new(world));
        state.number = number;
        state.base_from_flange = state.world.base_from_flange;
        let is_seen_anew = state.world.scene != old.scene;
        let scene = state.layout.scene + u64::from(is_seen_anew);
        state.layout = Arc::new(Layout { scene, places });
        state.expected = None;
        state.show_anew(&old, is_seen_anew);
        self.changed.notify_all();
    }

    /// The arm moved, or an object did; cameras that do not see it keep what they saw.
    pub(super) fn show(&self, scenery: Scenery) {
        let mut state = self.state.lock();
        if state.number == scenery.number && state.show(scenery, Instant::now()) {
            self.changed.notify_all();
        }
    }

    /// The flange moved, by hand.
    pub(super) fn set_flange(&self, base_from_flange: RigidTransform) {
        let mut state = self.state.lock();
        if state.move_flange(base_from_flange, Instant::now()) {
            self.changed.notify_all();
        }
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

    /// What frames of a binning will probably show: what is seen now, else what will be seen when the arm is back.
    pub(super) fn probable(&self, camera: usize, binning: Binning) -> Option<Exhibit> {
        let state = self.state.lock();
        state.exhibit(camera, binning).or_else(|| {
            let (view, layout) = state.expected_view(camera, binning)?;
            Some(state.exhibit_of(camera, state.cameras[camera].find(&view, layout)?))
        })
    }

    /// Whether what will be seen from where frames are taken is rendered.
    pub(super) fn is_prepared(&self, camera: usize) -> bool {
        let state = self.state.lock();
        let wall = &state.cameras[camera];
        let expected = state.expected_view(camera, wall.wanted);
        expected.is_some_and(|(view, layout)| wall.find(&view, layout).is_some())
    }

    /// Whether there is something of the binning that is wanted; fails when there will not be.
    pub(super) fn is_rendered(&self, camera: usize) -> Result<bool, SimError> {
        let state = self.state.lock();
        let wall = &state.cameras[camera];
        match &wall.failure {
            Some(reason) => Err(state.not_rendered(camera, Duration::ZERO, reason.clone())),
            None => Ok(state.exhibit(camera, wall.wanted).is_some()),
        }
    }

    /// The view at the binning that is wanted.
    pub(super) fn wait_for_wanted(&self, camera: usize, patience: Duration) -> Result<Exhibit, SimError> {
        let wanted = self.state.lock().cameras[camera].wanted;
        self.wait_for(camera, wanted, patience, false)
    }

    /// The view as the world is now, as soon as it is rendered. From where a frame was taken another one will be.
    pub(super) fn wait_for(
        &self,
        camera: usize,
        binning: Binning,
        patience: Duration,
        is_frame: bool,
    ) -> Result<Exhibit, SimError> {
        let (start, mut state) = (Instant::now(), self.state.lock());
        // A view that cannot be is not waited for.
        state.view(camera, binning)?;
        state.cameras[camera].awaited.push(binning);
        self.changed.notify_all();
        let outcome = self.wait_locked(&mut state, camera, binning, start, patience);
        let wall = &mut state.cameras[camera];
        if let Some(index) = wall.awaited.iter().position(|awaited| *awaited == binning) {
            wall.awaited.swap_remove(index);
        }
        if let (true, Ok(exhibit)) = (is_frame, &outcome) {
            wall.taken_from = Some(exhibit.sight.view.base_from_camera);
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
        let ahead = Ahead::new();
        while let Some(job) = self.next_job() {
            let outcome = job.render(&ahead);
            self.state.lock().hang(&job, outcome);
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
