//! The camera as the rest of the cell sees it.

use std::sync::{Mutex, mpsc};
use std::time::Duration;

use devices::{AppliedSettings, Camera, CameraError, CameraLink, CameraSettings, Frames};
use futures::future::BoxFuture;
use tokio::sync::{oneshot, watch};

use crate::CameraConfig;

/// A camera that answers is released within milliseconds; one that does not is left to the driver's thread.
const FAREWELL: Duration = Duration::from_millis(500);

/// Where the answer to a command goes.
type Reply<T> = oneshot::Sender<Result<T, CameraError>>;

/// What is asked of the camera's thread.
#[derive(Debug)]
#[cfg_attr(
    not(feature = "aravis"),
    expect(dead_code, reason = "without Aravis nobody reads what is asked")
)]
pub(crate) enum Command {
    Configure(CameraSettings, Reply<AppliedSettings>),
    Arm(usize, Reply<Frames>),
    Trigger(Reply<()>),
}

#[cfg(feature = "aravis")]
impl Command {
    pub(crate) fn refuse(self, error: CameraError) {
        // Who asked may have gone away meanwhile.
        let _ = match self {
            Self::Configure(_, reply) => reply.send(Err(error)).is_ok(),
            Self::Arm(_, reply) => reply.send(Err(error)).is_ok(),
            Self::Trigger(reply) => reply.send(Err(error)).is_ok(),
        };
    }
}

/// All that wakes the camera's thread.
#[derive(Debug)]
#[cfg_attr(
    not(feature = "aravis"),
    expect(dead_code, reason = "without Aravis nobody reads what is asked")
)]
pub(crate) enum Event {
    Command(Command),
    #[cfg(feature = "aravis")]
    Report(crate::driver::Report),
    End,
}

/// A GigE Vision camera, opened and kept open by a thread of its own.
///
/// A lost camera is opened again, and set up as it was, until this is dropped. Dropping it stops the acquisition and
/// releases control; it waits for that, half a second at most.
#[derive(Debug)]
pub struct AravisCamera {
    guid: String,
    events: mpsc::Sender<Event>,
    link: watch::Sender<CameraLink>,
    /// Hangs up when the thread has ended.
    ended: Mutex<mpsc::Receiver<()>>,
}

impl AravisCamera {
    /// Returns at once; [`Camera::link`] tells when the camera is open. A configuration that
    /// [`CameraConfig::check`] refuses leaves it lost for good, with that reason.
    pub fn open(config: CameraConfig) -> Self {
        let reason = format!("{} is being opened", config.guid);
        let (link, _) = watch::channel(CameraLink::Lost { reason });
        let (events, received) = mpsc::channel();
        let (alive, ended) = mpsc::channel();
        let camera = Self {
            guid: config.guid.clone(),
            events,
            link,
            ended: Mutex::new(ended),
        };
        if let Err(reason) = camera.start(config, received, alive) {
            camera.link.send_replace(CameraLink::Lost { reason });
        }
        camera
    }

    #[cfg(feature = "aravis")]
    fn start(
        &self,
        config: CameraConfig,
        events: mpsc::Receiver<Event>,
        alive: mpsc::Sender<()>,
    ) -> Result<(), String> {
        config.check().map_err(|error| error.to_string())?;
        let driver = crate::driver::Driver {
            events,
            reports: self.events.clone(),
            link: self.link.clone(),
            settings: None,
            number: 0,
            config,
        };
        let run = move || {
            driver.run();
            drop(alive);
        };
        std::thread::Builder::new()
            .name("camera".into())
            .spawn(run)
            .map(|_| ())
            .map_err(|error| format!("no thread for the camera: {error}"))
    }

    #[cfg(not(feature = "aravis"))]
    #[expect(clippy::unused_self, clippy::needless_pass_by_value, reason = "as it is with Aravis")]
    fn start(
        &self,
        config: CameraConfig,
        _events: mpsc::Receiver<Event>,
        _alive: mpsc::Sender<()>,
    ) -> Result<(), String> {
        config.check().map_err(|error| error.to_string())?;
        Err(crate::CameraAravisError::WithoutAravis.to_string())
    }

    fn lost(&self) -> Option<CameraError> {
        match &*self.link.borrow() {
            CameraLink::Lost { reason } => Some(self.lost_because(reason.clone())),
            CameraLink::Open { .. } => None,
        }
    }

    fn lost_because(&self, reason: String) -> CameraError {
        let guid = self.guid.clone();
        CameraError::Lost { guid, reason }
    }

    /// The command is on its way when this returns. A camera that is lost is not asked: its thread may be busy opening
    /// it for seconds.
    fn ask<T: Send + 'static>(
        &self,
        command: impl FnOnce(Reply<T>) -> Command,
    ) -> BoxFuture<'_, Result<T, CameraError>> {
        let (reply, answer) = oneshot::channel();
        let lost = self.lost();
        if lost.is_none() {
            // A thread that is gone drops the reply, which is an answer too.
            let _ = self.events.send(Event::Command(command(reply)));
        }
        Box::pin(async move {
            if let Some(lost) = lost {
                return Err(lost);
            }
            let gone = |_| Err(self.lost_because("its thread has ended".into()));
            answer.await.unwrap_or_else(gone)
        })
    }
}

impl Drop for AravisCamera {
    fn drop(&mut self) {
        let ended = self.ended.get_mut();
        if self.events.send(Event::End).is_ok()
            && let Ok(ended) = ended
        {
            // Whether it hung up or the time is over, there is nothing left to do.
            let _ = ended.recv_timeout(FAREWELL);
        }
    }
}

impl Camera for AravisCamera {
    fn configure(&self, settings: CameraSettings) -> BoxFuture<'_, Result<AppliedSettings, CameraError>> {
        self.ask(|reply| Command::Configure(settings, reply))
    }

    fn arm(&self, count: usize) -> BoxFuture<'_, Result<Frames, CameraError>> {
        self.ask(|reply| Command::Arm(count, reply))
    }

    fn trigger(&self) -> BoxFuture<'_, Result<(), CameraError>> {
        self.ask(Command::Trigger)
    }

    fn link(&self) -> watch::Receiver<CameraLink> {
        self.link.subscribe()
    }
}
