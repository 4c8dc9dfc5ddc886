//! `stop`, `recover`, `home` and `vacuum/set`, each in a task of its own: none waits for another.

use std::future::Future;
use std::sync::Arc;

use devices::{JointValues, Suction};
use interfaces::std_srvs::srv::{SetBool, SetBoolResponse, Trigger, TriggerResponse};
use ros::{Node, ServiceServer};
use tokio::task::JoinSet;
use tracing::Instrument;

use crate::error::{Error, MotionError};
use crate::executor::{Executor, Motion};
use crate::handling::Handling;
use crate::model::Model;
use crate::parameters::Parameters;
use crate::route::Router;

/// What the services need.
pub(crate) struct Desk {
    pub(crate) executor: Arc<Executor>,
    pub(crate) suction: Arc<dyn Suction>,
    pub(crate) parameters: Arc<Parameters>,
}

pub(crate) struct Services {
    stop: ServiceServer<Trigger>,
    recover: ServiceServer<Trigger>,
    home: ServiceServer<Trigger>,
    vacuum: ServiceServer<SetBool>,
    desk: Arc<Desk>,
}

impl Services {
    pub(crate) fn new(node: &Node, desk: Arc<Desk>) -> Result<Self, Error> {
        Ok(Self {
            stop: node.service_server("stop")?,
            recover: node.service_server("recover")?,
            home: node.service_server("home")?,
            vacuum: node.service_server("vacuum/set")?,
            desk,
        })
    }

    pub(crate) fn spawn_into(self, tasks: &mut JoinSet<()>) {
        let Self {
            stop,
            recover,
            home,
            vacuum,
            desk,
        } = self;
        let serve = |tasks: &mut JoinSet<()>, server, name, job: fn(Arc<Desk>) -> Job| {
            tasks.spawn(serve_trigger(server, name, Arc::clone(&desk), job).in_current_span());
        };
        serve(tasks, stop, "stop", |desk| Box::pin(async move { desk.stop().await }));
        serve(tasks, recover, "recover", |desk| {
            Box::pin(async move { desk.recover(true).await })
        });
        serve(tasks, home, "home", |desk| Box::pin(async move { desk.home().await }));
        tasks.spawn(serve_vacuum(vacuum, desk).in_current_span());
    }
}

type Job = std::pin::Pin<Box<dyn Future<Output = Result<String, MotionError>> + Send>>;

/// Calls are answered in tasks of their own: a second `stop` does not wait for the first.
async fn serve_trigger(
    mut server: ServiceServer<Trigger>,
    name: &'static str,
    desk: Arc<Desk>,
    job: fn(Arc<Desk>) -> Job,
) {
    let mut calls = JoinSet::new();
    while let Some(call) = server.next().await {
        while calls.try_join_next().is_some() {}
        let job = job(Arc::clone(&desk));
        let answer = async move {
            let response = match job.await {
                Ok(message) => TriggerResponse { success: true, message },
                Err(error) => {
                    tracing::warn!(%error, "{name}: not done");
                    TriggerResponse {
                        success: false,
                        message: error.to_string(),
                    }
                }
            };
            if let Err(error) = call.respond(response).await {
                tracing::warn!(%error, "an answer is lost");
            }
        };
        calls.spawn(answer.in_current_span());
    }
}

async fn serve_vacuum(mut server: ServiceServer<SetBool>, desk: Arc<Desk>) {
    while let Some(call) = server.next().await {
        let outcome = desk.suction.set(call.request().data).await;
        if let Err(error) = &outcome {
            tracing::warn!(%error, "the vacuum was not set");
        }
        let response = SetBoolResponse {
            success: outcome.is_ok(),
            message: outcome.err().map(|error| error.to_string()).unwrap_or_default(),
        };
        if let Err(error) = call.respond(response).await {
            tracing::warn!(%error, "an answer is lost");
        }
    }
}

impl Desk {
    async fn stop(&self) -> Result<String, MotionError> {
        self.executor.stop("by the service `stop`").await?;
        Ok("the arm is at rest; `recover` makes it ready".into())
    }

    pub(crate) async fn recover(&self, looked: bool) -> Result<String, MotionError> {
        let home = self.home_angles()?;
        self.executor
            .recover(&home, &self.parameters.base_frame_id, looked)
            .await?;
        Ok("the arm is ready".into())
    }

    async fn home(&self) -> Result<String, MotionError> {
        let home = self.home_angles()?;
        let (at, speed) = (self.executor.held_at()?, self.parameters.tool_speed.get());
        let executor = Arc::clone(&self.executor);
        let planning = tokio::task::spawn_blocking(move || way_home(&executor.model(), speed, &at, &home));
        let motion = planning.await.map_err(|error| unplanned(&error))??;
        let tolerance = self.parameters.start_tolerance.get();
        self.executor.begin(motion, tolerance)?.ended().await?;
        Ok("the arm is at home".into())
    }

    pub(crate) fn home_angles(&self) -> Result<JointValues, MotionError> {
        self.parameters
            .home()
            .map_err(|error| MotionError::Request(error.to_string()))
    }
}

/// A cup that was stopped in a touch leaves it straight up.
fn way_home(model: &Model, speed: f64, at: &JointValues, home: &JointValues) -> Result<Motion, MotionError> {
    let planner = model.planner(speed)?;
    let mut router = Router {
        model,
        planner: &planner,
        handling: Handling::default(),
    };
    let trajectory = match router.to_angles(at, home) {
        Err(error @ MotionError::Collision { .. }) => {
            router.handling.contact = true;
            router.lifted(at, home).ok_or(error)?
        }
        found => found?,
    };
    Ok(Motion {
        trajectory,
        speed,
        handling: router.handling,
    })
}

/// A plan whose thread failed.
pub(crate) fn unplanned(error: &tokio::task::JoinError) -> MotionError {
    MotionError::Request(format!("planning failed: {error}"))
}
