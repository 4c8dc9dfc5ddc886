//! The cell's ROS 2 layer.
//!
//! This crate is the only one that knows `ros2-client` and `RustDDS`. Everything above it sees typed handles:
//! a [`Node`] makes publishers, subscriptions, services, actions and parameters, and a message is an
//! [`interfaces::Message`], whoever the peer is: a node in the same process, another process, or `rclpy`.
//!
//! What it adds to the client library below it:
//!
//! - **One participant per node.** Nodes that share a process keep separate graphs entries and event loops.
//! - **In-process hand-over.** Publisher and subscription in one process share an `Arc`; DDS sees the message only
//!   while a reader outside the process is matched. The API is the same.
//! - **Named QoS** ([`Qos::MAP`], [`Qos::IMAGE`], ...), checked for compatibility.
//! - **Services and actions that lose nothing**: one dispatcher per client, time-outs everywhere.
//! - **What ROS clients expect of any node**: [`parameters`] with ranges and units, [`clock`] (`use_sim_time`), [`tf`],
//!   [`diagnostics`], and [`logging`] on `/rosout`.
//!
//! It is *not* a general client library: it has what the cell's nodes use.
//!
//! ```no_run
//! # async fn example() -> Result<(), ros::Error> {
//! use interfaces::sensor_msgs::msg::Image;
//!
//! let node = ros::Node::start(ros::NodeOptions::new("brightness").namespace("/cell")).await?;
//! let mut images = node.subscription::<Image>("c1/image_raw", ros::Qos::IMAGE)?;
//! while let Some(image) = images.next().await {
//!     println!("{} x {}", image.message.width, image.message.height);
//! }
//! node.shutdown().await;
//! # Ok(())
//! # }
//! ```

pub mod action;
mod arguments;
pub mod clock;
pub mod diagnostics;
mod error;
mod graph;
mod handover;
mod launch_config;
pub mod logging;
mod names;
mod node;
mod options;
pub mod parameters;
mod participant;
mod publisher;
mod qos;
mod rosout;
mod service;
mod standard_interfaces;
mod subscription;
pub mod tf;
mod transport_counters;
mod wire;

pub use action::{ActionClient, ActionServer, ActiveGoal, GoalEvent, GoalHandle, GoalId, GoalOffer, GoalStatus};
pub use arguments::RosArguments;
pub use clock::Clock;
pub use error::Error;
pub use launch_config::{Cell, LaunchConfig};
pub use names::{NameError, Remap};
pub use node::Node;
pub use options::{DiscoveryRange, NodeOptions};
pub use parameters::{Parameter, ParameterHandle, ParameterValue};
pub use publisher::Publisher;
pub use qos::{Durability, Qos, Reliability};
pub use rosout::RosoutLayer;
pub use service::{ServiceCall, ServiceClient, ServiceServer};
pub use subscription::{Received, Source, Subscription};
