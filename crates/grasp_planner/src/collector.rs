//! One camera's share of the node: collects what is published of its captures.

use std::sync::Arc;
use std::time::Duration;

use futures::FutureExt;
use futures::future::select_all;
use geometry::RigidTransform;
use interfaces::rakelight_msgs::msg::Exposure;
use interfaces::sensor_msgs::msg::{CameraInfo, Image};
use interfaces::std_msgs::msg::Header;
use ros::parameters::ParameterHandle;
use ros::{Node, Qos, Received, Subscription, tf};

use crate::captures::Captures;
use crate::error::{Error, ViewError};
use crate::joiner::{Joiner, MAPS, Maps};
use crate::parameters::Parameters;
use crate::view::SolvedView;

/// How long a transform or a `camera_info` may come after the results that need it.
const PATIENCE: Duration = Duration::from_secs(1);

pub(crate) struct Collector {
    camera: String,
    base_frame_id: ParameterHandle<String>,
    kept: ParameterHandle<i64>,
    transforms: Arc<tf::Listener>,
    infos: Subscription<CameraInfo>,
    info: Option<Arc<CameraInfo>>,
    exposures: Subscription<Exposure>,
    maps: Vec<Subscription<Image>>,
    joiner: Joiner,
    captures: Captures,
}

impl Collector {
    pub(crate) fn new(
        node: &Node,
        camera: &str,
        parameters: &Parameters,
        transforms: Arc<tf::Listener>,
        captures: Captures,
    ) -> Result<Self, Error> {
        let map = |what: &str| node.subscription(&format!("{camera}/{what}"), Qos::MAP);
        Ok(Self {
            camera: camera.to_owned(),
            base_frame_id: parameters.base_frame_id.clone(),
            kept: parameters.keep_captures.clone(),
            transforms,
            infos: node.subscription(&format!("{camera}/camera_info"), Qos::LATCHED)?,
            info: None,
            exposures: node.subscription(&format!("{camera}/exposure"), Qos::STREAM)?,
            maps: MAPS.into_iter().map(map).collect::<Result<_, _>>()?,
            joiner: Joiner::default(),
            captures,
        })
    }

    /// Collects until the node is shut down.
    pub(crate) async fn run(mut self) {
        loop {
            tokio::select! {
                exposure = self.exposures.next() => match exposure {
                    Some(exposure) => self.begin(&exposure.message),
                    None => return,
                },
                info = self.infos.next() => match info {
                    Some(info) => self.info = Some(info.message),
                    None => return,
                },
                (which, map) = next_map(&mut self.maps) => match map {
                    Some(map) => self.joiner.add_map(which, map.message),
                    None => return,
                },
            }
            if let Some((id, maps)) = self.joiner.take_whole() {
                self.settle(&id, maps).await;
            } else if let Some((id, lacking)) = self.joiner.lacking() {
                let lacking = lacking.join(", ");
                let awaited = format!("{lacking} (normal_solver gives them when it has lights.file)");
                self.captures.awaits(&id, &self.camera, awaited);
            }
        }
    }

    fn begin(&mut self, exposure: &Exposure) {
        if let Some(id) = self.joiner.add_exposure(exposure) {
            self.captures.begin(&id, &self.camera, self.kept.get() as usize);
        }
    }

    async fn settle(&mut self, id: &str, maps: Maps) {
        match self.view(maps).await {
            Ok(view) => self.captures.solved(id, view),
            Err(error) => {
                tracing::warn!(camera = self.camera, capture_id = id, %error, "a view cannot be planned on");
                self.captures.failed(id, &self.camera, error.to_string());
            }
        }
    }

    async fn view(&mut self, maps: Maps) -> Result<SolvedView, ViewError> {
        // Now: TF forgets, and the next capture may have another lens.
        let info = self.info().await?;
        let base_from_camera = self.base_from_camera(&maps[0].header).await?;
        let camera = self.camera.clone();
        let read = tokio::task::spawn_blocking(move || SolvedView::read(camera, &info, base_from_camera, &maps));
        read.await.expect("reading does not panic")
    }

    async fn info(&mut self) -> Result<Arc<CameraInfo>, ViewError> {
        if self.info.is_none() {
            let waited = tokio::time::timeout(PATIENCE, self.infos.next()).await;
            self.info = waited.ok().flatten().map(|info| info.message);
        }
        self.info.clone().ok_or(ViewError::NoCameraInfo)
    }

    async fn base_from_camera(&self, header: &Header) -> Result<RigidTransform, ViewError> {
        let (base, frame) = (self.base_frame_id.get(), &header.frame_id);
        let placed = self
            .transforms
            .wait_for(&base, frame, header.stamp.to_nanos(), PATIENCE);
        placed.await.map_err(|problem| ViewError::Frame {
            frame: frame.clone(),
            base,
            problem: Box::new(problem),
        })
    }
}

/// The next map of any topic, and of which.
async fn next_map(maps: &mut [Subscription<Image>]) -> (usize, Option<Received<Image>>) {
    let (map, which, _) = select_all(maps.iter_mut().map(|map| map.next().boxed())).await;
    (which, map)
}
