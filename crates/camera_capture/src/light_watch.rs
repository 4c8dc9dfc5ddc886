//! Watches the lights: measures every capture after it was answered, and reports what it finds on `/diagnostics`.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use geometry::RigidTransform;
use parking_lot::Mutex;
use photometric::{LightMeasurement, PanelHealth, PanelVerdict};
use ros::diagnostics::{Level, Status};
use ros::{Node, ParameterHandle, tf};
use tokio::sync::mpsc;

use crate::camera::CaptureCamera;
use crate::convert;
use crate::join::JoinedFrame;
use crate::parameters::HealthParameters;

/// How long a moving camera's transform may come after its images.
const TRANSFORM_PATIENCE: Duration = Duration::from_millis(500);

/// One camera's share of a capture, to be measured.
pub(crate) struct Sample {
    pub(crate) camera: String,
    pub(crate) capture_id: String,
    pub(crate) frames: Vec<JoinedFrame>,
}

/// What is known of the lights. Clones are handles to the same knowledge.
#[derive(Clone)]
pub(crate) struct LightWatch {
    inner: Arc<Inner>,
    samples: mpsc::Sender<Vec<Sample>>,
}

struct Inner {
    views: BTreeMap<String, View>,
    parameters: HealthParameters,
    base_frame_id: String,
    transforms: Option<tf::Listener>,
    reports: Mutex<BTreeMap<String, Report>>,
    learned: Mutex<BTreeMap<String, Vec<f64>>>,
}

/// How a camera sees the lights.
struct View {
    frame_id: String,
    /// `None`: it moves, or its place is told elsewhere.
    base_from_camera: Option<RigidTransform>,
    /// Signals of the panels that drift is measured from; empty: learned.
    reference: ParameterHandle<Vec<f64>>,
}

/// What the last capture of a camera showed.
#[derive(Debug, Clone)]
struct Report {
    capture_id: String,
    measurement: LightMeasurement,
    panels: Vec<PanelHealth>,
    /// Whether the camera's place was known.
    is_placed: bool,
}

impl LightWatch {
    /// Begins to watch. Gives the samples' other end, for [`Self::run`].
    pub(crate) fn new(
        node: &Node,
        cameras: &[CaptureCamera],
        parameters: HealthParameters,
        base_frame_id: String,
    ) -> Result<(Self, mpsc::Receiver<Vec<Sample>>), ros::Error> {
        let view = |camera: &CaptureCamera| {
            let standing = camera
                .place
                .as_ref()
                .filter(|place| place.parent_frame_id == base_frame_id);
            let view = View {
                frame_id: camera.parameters.frame_id.get(),
                base_from_camera: standing.map(|place| place.parent_from_camera),
                reference: camera.parameters.light_reference.clone(),
            };
            (camera.name.clone(), view)
        };
        let views: BTreeMap<String, View> = cameras.iter().map(view).collect();
        let needs_transforms = views.values().any(|view| view.base_from_camera.is_none());
        let inner = Arc::new(Inner {
            transforms: needs_transforms.then(|| tf::Listener::new(node)).transpose()?,
            views,
            parameters,
            base_frame_id,
            reports: Mutex::default(),
            learned: Mutex::default(),
        });
        let reported = Arc::downgrade(&inner);
        node.diagnostics()
            .register("lights", "", move || match reported.upgrade() {
                Some(inner) => inner.status(),
                None => Status::stale("the node has ended"),
            });
        // One capture is measured while another waits; more would only be out of date.
        let (samples, receiver) = mpsc::channel(1);
        Ok((Self { inner, samples }, receiver))
    }

    /// Measures a capture soon, unless others wait.
    pub(crate) fn offer(&self, samples: Vec<Sample>) {
        if self.samples.try_send(samples).is_err() {
            tracing::debug!("a capture is not measured: captures come too quickly");
        }
    }

    /// Measures what is offered until the node ends.
    pub(crate) async fn run(self, mut samples: mpsc::Receiver<Vec<Sample>>) {
        let Self { inner, samples: own } = self;
        drop(own);
        while let Some(samples) = samples.recv().await {
            for sample in samples {
                inner.measure(sample).await;
            }
        }
    }

    /// Makes what every camera saw last the reference; says for which, or why not.
    pub(crate) fn set_reference(&self) -> Result<String, String> {
        let reports = self.inner.reports.lock().clone();
        if reports.is_empty() {
            return Err("no capture was measured yet: take one first".into());
        }
        for (camera, report) in &reports {
            let signals = report.measurement.signals();
            if let Some(view) = self.inner.views.get(camera) {
                let set = view.reference.set(signals);
                set.map_err(|error| format!("camera {camera}: {error}"))?;
            }
        }
        let set = reports
            .iter()
            .map(|(camera, report)| format!("{camera} from {}", report.capture_id));
        Ok(set.collect::<Vec<_>>().join(", "))
    }
}

impl Inner {
    async fn measure(&self, sample: Sample) {
        let Some(view) = self.views.get(&sample.camera) else {
            return;
        };
        let Sample {
            camera,
            capture_id,
            frames,
        } = sample;
        let stamp = frames.first().map_or(0, |frame| frame.stamp);
        let measured = tokio::task::spawn_blocking(move || {
            convert::sampled_stack(&frames).map(|stack| LightMeasurement::of(&stack))
        });
        let measurement = match measured.await {
            Ok(Ok(measurement)) => measurement,
            Ok(Err(error)) => return tracing::warn!(camera, %error, "the lights are not measured"),
            // The runtime has reported a panic already.
            Err(_) => return,
        };
        let base_from_camera = self.base_from_camera(view, stamp).await;
        let rotation = base_from_camera.map(|transform| transform.rotation_matrix());
        let reference = self.reference(&camera, view);
        let panels = measurement.judge(reference.as_deref(), rotation.as_ref(), self.parameters.limits());
        let report = Report {
            capture_id,
            measurement,
            panels,
            is_placed: rotation.is_some(),
        };
        self.tell(&camera, &report);
        self.learn(&camera, &report);
        self.reports.lock().insert(camera, report);
    }

    /// A transform that is missing is not an identity: then nothing is said about directions.
    async fn base_from_camera(&self, view: &View, stamp: i64) -> Option<RigidTransform> {
        if view.base_from_camera.is_some() {
            return view.base_from_camera;
        }
        let transforms = self.transforms.as_ref()?;
        let found = transforms.wait_for(&self.base_frame_id, &view.frame_id, stamp, TRANSFORM_PATIENCE);
        found.await.ok()
    }

    fn reference(&self, camera: &str, view: &View) -> Option<Vec<f64>> {
        let set = view.reference.get();
        if set.is_empty() {
            return self.learned.lock().get(camera).cloned();
        }
        Some(set)
    }

    /// The first capture in which every panel is in order is what later ones are held to.
    fn learn(&self, camera: &str, report: &Report) {
        if report.panels.iter().all(|panel| panel.verdict == PanelVerdict::Good) {
            let mut learned = self.learned.lock();
            learned
                .entry(camera.to_owned())
                .or_insert_with(|| report.measurement.signals());
        }
    }

    /// Says what was not so at the last capture.
    fn tell(&self, camera: &str, report: &Report) {
        let before = self.reports.lock().get(camera).map(|report| report.panels.clone());
        for (at, panel) in report.panels.iter().enumerate() {
            let was = before
                .as_ref()
                .and_then(|panels| panels.get(at))
                .map(|panel| panel.verdict);
            if let Some(problem) = problem(panel)
                && was != Some(panel.verdict)
            {
                tracing::warn!(camera, capture_id = report.capture_id, "{problem}");
            }
        }
    }

    fn status(&self) -> Status {
        let reports = self.reports.lock();
        if reports.is_empty() {
            return Status::ok("no capture was measured yet");
        }
        let ambient = self.parameters.ambient();
        let mut problems: Vec<(Level, String)> = Vec::new();
        for (camera, report) in reports.iter() {
            let found = report
                .panels
                .iter()
                .filter_map(|panel| Some((level(panel.verdict), problem(panel)?)));
            problems.extend(found.map(|(level, problem)| (level, format!("{camera}: {problem}"))));
            let dark = report.measurement.ambient;
            if !ambient.contains(&dark) {
                let allowed = format!("{} to {}", ambient.start(), ambient.end());
                problems.push((
                    Level::Warn,
                    format!("{camera}: ambient light {dark:.0}, expected {allowed}"),
                ));
            }
        }
        let worst = problems.iter().map(|(level, _)| *level).max().unwrap_or(Level::Ok);
        let texts: Vec<String> = problems.into_iter().map(|(_, text)| text).collect();
        let message = if texts.is_empty() {
            "all panels in order".into()
        } else {
            texts.join("; ")
        };
        reports
            .iter()
            .fold(Status::new(worst, message), |status, (camera, report)| {
                with_values(status, camera, report)
            })
    }
}

fn level(verdict: PanelVerdict) -> Level {
    match verdict {
        PanelVerdict::Good => Level::Ok,
        PanelVerdict::Drifted => Level::Warn,
        PanelVerdict::Swapped { .. } | PanelVerdict::Dead => Level::Error,
    }
}

fn problem(panel: &PanelHealth) -> Option<String> {
    let PanelHealth {
        channel,
        signal,
        relative_share,
        azimuth_degrees,
        verdict,
    } = panel;
    match verdict {
        PanelVerdict::Good => None,
        PanelVerdict::Dead => Some(format!("L{channel} is dark (signal {signal:.0})")),
        PanelVerdict::Drifted => {
            relative_share.map(|share| format!("L{channel} gives {:.0} % of its share of the light", 100.0 * share))
        }
        PanelVerdict::Swapped { looks_like } => {
            let from = azimuth_degrees.map_or_else(|| "above".into(), |azimuth| format!("{azimuth:.0} degrees"));
            Some(format!("L{channel} shines from {from}, where L{looks_like} should be"))
        }
    }
}

fn with_values(status: Status, camera: &str, report: &Report) -> Status {
    let Report {
        capture_id,
        measurement,
        panels,
        is_placed,
    } = report;
    let mut status = status
        .value(format!("{camera} capture"), capture_id, "")
        .value(format!("{camera} ambient"), format!("{:.0}", measurement.ambient), "")
        .value(format!("{camera} noise"), format!("{:.1}", measurement.noise), "");
    if !is_placed {
        status = status.value(
            format!("{camera} directions"),
            "not checked: the camera's place is unknown",
            "",
        );
    }
    for panel in panels {
        let name = |what: &str| format!("{camera} L{} {what}", panel.channel);
        status = status.value(name("signal"), format!("{:.0}", panel.signal), "");
        if let Some(share) = panel.relative_share {
            status = status.value(name("share of reference"), format!("{:.1}", 100.0 * share), "%");
        }
        if let Some(azimuth) = panel.azimuth_degrees {
            status = status.value(name("azimuth"), format!("{azimuth:.0}"), "deg");
        }
    }
    status
}
