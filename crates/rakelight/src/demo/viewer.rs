//! A node that receives normal maps, as any program outside would.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::sync::Arc;

use anyhow::Context;
use imaging::{Mask, normal_picture, write_png};
use interfaces::sensor_msgs::msg::Image as ImageMessage;
use ros::{Node, NodeOptions, Qos};
use tokio::sync::mpsc;

use crate::image_message::normal_map;

/// A normal map and whose it is.
pub(crate) struct Map {
    pub(crate) camera: String,
    pub(crate) image: Arc<ImageMessage>,
}

pub(crate) struct Viewer {
    node: Node,
    maps: mpsc::Receiver<Map>,
}

impl Viewer {
    pub(crate) async fn start(options: NodeOptions, cameras: &[String]) -> anyhow::Result<Self> {
        let node = Node::start(options).await?;
        let (sender, maps) = mpsc::channel(cameras.len().max(1));
        for camera in cameras {
            let mut subscription = node.subscription::<ImageMessage>(&format!("{camera}/normals"), Qos::MAP)?;
            let (camera, sender) = (camera.clone(), sender.clone());
            tokio::spawn(async move {
                while let Some(received) = subscription.next().await {
                    let map = Map {
                        camera: camera.clone(),
                        image: received.message,
                    };
                    if sender.send(map).await.is_err() {
                        return;
                    }
                }
            });
        }
        Ok(Self { node, maps })
    }

    /// The next map of any camera.
    pub(crate) async fn next(&mut self) -> anyhow::Result<Map> {
        self.maps.recv().await.context("the viewer's node is shut down")
    }

    pub(crate) async fn stop(self) {
        self.node.shutdown().await;
    }
}

/// Writes the map in colours, black outside the mask, and gives the share of pixels that are measured.
pub(crate) fn write_picture(map: &Map, mask: Option<&Mask>, path: &Path) -> anyhow::Result<f64> {
    let mut normals = normal_map(&map.image)?;
    if let Some(mask) = mask {
        mask.fill_outside(&mut normals, [f32::NAN; 3])?;
    }
    let file = File::create(path).with_context(|| format!("cannot write {}", path.display()))?;
    write_png(&normal_picture(&normals), BufWriter::new(file))?;
    let measured = normals.pixels().iter().filter(|normal| normal[2].is_finite()).count();
    Ok(measured as f64 / mask.map_or(normals.pixels().len(), Mask::count) as f64)
}
