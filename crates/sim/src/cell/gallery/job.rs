//! What is rendered next, and by whom.

use std::sync::Arc;
use std::time::Instant;

use rayon::{ThreadPool, ThreadPoolBuilder};

use super::Sight;
use super::layout::Layout;
use super::state::State;
use crate::SimError;
use crate::render::{RenderOptions, render};
use crate::scene::View;
use crate::world::World;

/// How much threads that work ahead give way to others, 0 to 19: the arm moves meanwhile, and a frame may wait for them
/// in the end.
const NICENESS: i32 = 2;

/// Something to render.
pub(super) struct Job {
    pub(super) camera: usize,
    pub(super) view: View,
    pub(super) layout: Arc<Layout>,
    world: Arc<World>,
    /// Nobody waits for it.
    is_ahead: bool,
}

/// Who renders what nobody waits for; none where the system has no threads to spare.
pub(super) struct Ahead(Option<ThreadPool>);

impl Ahead {
    pub(super) fn new() -> Self {
        let builder = ThreadPoolBuilder::new().thread_name(|index| format!("render ahead {index}"));
        let give_way = |_| {
            // Where it may not, it is only less kind.
            let _ = rustix::process::setpriority_process(Some(rustix::thread::gettid()), NICENESS);
        };
        Self(builder.start_handler(give_way).build().ok())
    }
}

impl Job {
    pub(super) fn render(&self, ahead: &Ahead) -> Result<Sight, SimError> {
        let start = Instant::now();
        let scene = self.layout.scene(&self.world);
        // The renderer's own noise does not follow the sensors' seed: a world seen twice is seen alike.
        let work = || render(&scene, &self.view, &RenderOptions::default());
        let rendered = match &ahead.0 {
            Some(pool) if self.is_ahead => pool.install(work),
            _ => work(),
        }?;
        tracing::debug!(
            camera = self.camera + 1,
            is_ahead = self.is_ahead,
            took = ?start.elapsed(),
            "rendered"
        );
        Ok(Sight {
            view: self.view,
            rendered,
            took: start.elapsed(),
        })
    }
}

impl State {
    /// What frames wait for; then what is seen by cameras that stand where frames are taken; then what they will see there
    /// when the arm comes back; then what is seen from anywhere else, once it is still.
    pub(super) fn next_job(&self, now: Instant) -> Option<Job> {
        let open = || (0..self.cameras.len()).filter(|camera| self.cameras[*camera].failure.is_none());
        let awaited = || open().find_map(|camera| self.awaited_job(camera));
        let usual = || open().filter(|camera| self.is_where_frames_are_taken(*camera));
        let still = |camera: usize| (self.cameras[camera].still_at <= now).then(|| self.wanted_job(camera))?;
        awaited()
            .or_else(|| usual().find_map(still))
            .or_else(|| open().find_map(|camera| self.ahead_job(camera)))
            .or_else(|| open().find_map(still))
    }

    fn awaited_job(&self, camera: usize) -> Option<Job> {
        let binnings = self.cameras[camera].awaited.iter();
        binnings.copied().find_map(|binning| {
            let view = self.view(camera, binning).ok()?;
            self.job(camera, view, &self.layout, false)
        })
    }

    fn wanted_job(&self, camera: usize) -> Option<Job> {
        let view = self.view(camera, self.cameras[camera].wanted).ok()?;
        self.job(camera, view, &self.layout, false)
    }

    fn ahead_job(&self, camera: usize) -> Option<Job> {
        let (view, layout) = self.expected_view(camera, self.cameras[camera].wanted)?;
        self.job(camera, view, layout, true)
    }

    fn job(&self, camera: usize, view: View, layout: &Arc<Layout>, is_ahead: bool) -> Option<Job> {
        let is_missing = self.cameras[camera].find(&view, layout).is_none();
        is_missing.then(|| Job {
            camera,
            view,
            layout: Arc::clone(layout),
            world: Arc::clone(&self.world),
            is_ahead,
        })
    }
}
