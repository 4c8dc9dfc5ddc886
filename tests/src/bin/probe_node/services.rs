//! The probe's services.

use std::sync::atomic::Ordering;
use std::time::Duration;

use interfaces::std_srvs::srv::{SetBool, SetBoolResponse, Trigger, TriggerResponse};
use ros::{Node, ServiceServer};

use crate::Options;
use crate::topics::Publishing;

pub(crate) struct Services {
    status: ServiceServer<Trigger>,
    publish: ServiceServer<SetBool>,
    slow: ServiceServer<Trigger>,
}

impl Services {
    pub(crate) fn new(node: &Node) -> Result<Self, ros::Error> {
        Ok(Self {
            status: node.service_server("~/status")?,
            publish: node.service_server("~/publish")?,
            slow: node.service_server("~/slow")?,
        })
    }

    pub(crate) async fn serve(self, options: &Options, publishing: &Publishing) -> anyhow::Result<()> {
        let Self { status, publish, slow } = self;
        tokio::try_join!(
            serve_status(status, publishing),
            serve_publish(publish, publishing),
            serve_slow(slow, Duration::from_secs_f64(options.slow_secs)),
        )?;
        Ok(())
    }
}

async fn serve_status(mut server: ServiceServer<Trigger>, publishing: &Publishing) -> anyhow::Result<()> {
    while let Some(call) = server.next().await {
        let message = format!("{} published", publishing.published.load(Ordering::Relaxed));
        call.respond(TriggerResponse { success: true, message }).await?;
    }
    Ok(())
}

async fn serve_publish(mut server: ServiceServer<SetBool>, publishing: &Publishing) -> anyhow::Result<()> {
    while let Some(call) = server.next().await {
        let enabled = call.request().data;
        let before = publishing.enabled.swap(enabled, Ordering::Relaxed);
        let message = format!("publishing was {before} and is {enabled}");
        call.respond(SetBoolResponse { success: true, message }).await?;
    }
    Ok(())
}

async fn serve_slow(mut server: ServiceServer<Trigger>, delay: Duration) -> anyhow::Result<()> {
    while let Some(call) = server.next().await {
        println!("slow call");
        tokio::spawn(async move {
            tokio::time::sleep(delay).await;
            call.respond(TriggerResponse {
                success: true,
                message: "at last".into(),
            })
            .await
        });
    }
    Ok(())
}
