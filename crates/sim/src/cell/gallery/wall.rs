//! What is there of one camera.

use std::sync::Arc;
use std::time::Instant;

use geometry::RigidTransform;

use super::layout::{Layout, is_as_seen};
use super::{Binning, Sight};
use crate::scene::View;

/// Views kept of a camera, at most; one at full resolution takes some 115 MB.
const MOST_SHOWN: usize = 3;

#[derive(Debug)]
pub(super) struct Wall {
    /// The binning that will be asked for.
    pub(super) wanted: Binning,
    shown: Vec<Shown>,
    /// Binnings that frames wait for.
    pub(super) awaited: Vec<Binning>,
    /// `base_from_camera` when it last gave a frame: it is expected there again.
    pub(super) taken_from: Option<RigidTransform>,
    /// Of the sensor's noise: it begins anew with this.
    pub(super) series: u64,
    /// Not to be rendered before.
    pub(super) still_at: Instant,
    /// Why the last attempt failed.
    pub(super) failure: Option<String>,
}

/// A rendered view.
#[derive(Debug, Clone)]
pub(super) struct Shown {
    /// No other has it.
    pub(super) number: u64,
    pub(super) layout: Arc<Layout>,
    pub(super) sight: Arc<Sight>,
}

impl Wall {
    pub(super) fn new(binning: u32) -> Self {
        Self {
            wanted: [binning; 2],
            shown: Vec::new(),
            awaited: Vec::new(),
            taken_from: None,
            series: 0,
            still_at: Instant::now(),
            failure: None,
        }
    }

    pub(super) fn find(&self, view: &View, layout: &Layout) -> Option<&Shown> {
        self.shown.iter().find(|shown| shown.is_of(view, layout))
    }

    /// Those that are needed stay longest, `needed` tells which; of the others the newest.
    pub(super) fn hang(&mut self, shown: Shown, needed: impl Fn(&Shown) -> bool) {
        self.shown.push(shown);
        while self.shown.len() > MOST_SHOWN {
            let first = self.shown.iter().position(|shown| !needed(shown)).unwrap_or(0);
            self.shown.remove(first);
        }
    }

    /// Nothing of another scene is seen again.
    pub(super) fn keep_scene(&mut self, scene: u64) {
        self.shown.retain(|shown| shown.layout.scene == scene);
    }
}

impl Shown {
    pub(super) fn is_of(&self, view: &View, layout: &Layout) -> bool {
        self.sight.view.camera == view.camera
            && is_as_seen(&self.sight.view.base_from_camera, &view.base_from_camera)
            && self.layout.is_as_seen(layout)
    }
}
