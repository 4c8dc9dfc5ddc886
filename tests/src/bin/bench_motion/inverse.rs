//! Inverse kinematics from the home angles, and forward kinematics beside pinocchio's.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::{Context, ensure};
use devices::JointValues;
use fastrand::Rng;
use kinematics::IkOptions;
use nalgebra::{SVector, Vector3};
use scenarios::quantile;
use serde::{Deserialize, Serialize};

use crate::arm::{Arm, HOME, urdf};

/// How far a solution may be off, metres and radians.
const CLOSE: f64 = 1e-5;
/// Rounds over all poses; the median counts.
const ROUNDS: usize = 21;

#[derive(Debug, Serialize)]
pub(crate) struct Inverse {
    pub(crate) ik_poses: usize,
    /// Share of the poses.
    pub(crate) ik_success: f64,
    /// Share that the home angles led to without a random start.
    pub(crate) ik_from_home: f64,
    pub(crate) ik_median_us: f64,
    pub(crate) ik_p99_us: f64,
    pub(crate) ik_max_us: f64,
    /// Tool pose and Jacobian.
    pub(crate) fk_us: f64,
    /// None where it is missing.
    pub(crate) pinocchio: Option<Peer>,
}

/// What `tests/peers/motion_peer.py` tells.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Peer {
    pub(crate) version: String,
    /// `forwardKinematics` and `computeJointJacobians`, with the calls from Python.
    pub(crate) fk_us: f64,
    /// Two calls from Python into the library that do next to nothing.
    pub(crate) calls_us: f64,
    /// Of the tool, metres.
    #[serde(skip_serializing)]
    tips: Vec<[f64; 3]>,
    /// Largest distance between its tools and ours, metres.
    #[serde(default)]
    pub(crate) apart_m: f64,
}

pub(crate) fn measure(arm: &Arm, poses: u64) -> anyhow::Result<Inverse> {
    let mut random = Rng::with_seed(1);
    let places: Vec<JointValues> = (0..poses).map(|_| arm.anywhere(&mut random)).collect();
    let (mut times, mut solved, mut from_home) = (Vec::with_capacity(places.len()), 0_usize, 0_usize);
    for angles in &places {
        let pose = arm.chain.forward(&SVector::from(*angles))?;
        let started = Instant::now();
        let found = arm.chain.solve(&pose, &SVector::from(HOME), &IkOptions::default());
        times.push(1e6 * started.elapsed().as_secs_f64());
        let Ok(found) = found else { continue };
        let reached = arm.chain.forward(&found.angles)?;
        let apart = (reached.translation() - pose.translation()).norm();
        let is_close = apart < CLOSE && reached.rotation().angle_to(&pose.rotation()) < CLOSE;
        solved += usize::from(is_close);
        from_home += usize::from(is_close && found.attempts == 1);
    }
    let at = |share| quantile(&times, share).unwrap_or(f64::NAN);
    Ok(Inverse {
        ik_poses: places.len(),
        ik_success: solved as f64 / places.len() as f64,
        ik_from_home: from_home as f64 / places.len() as f64,
        ik_median_us: at(0.5),
        ik_p99_us: at(0.99),
        ik_max_us: at(1.0),
        fk_us: forward_us(arm, &places)?,
        pinocchio: pinocchio(arm, &places)?,
    })
}

fn forward_us(arm: &Arm, places: &[JointValues]) -> anyhow::Result<f64> {
    let (mut rounds, mut sum) = (Vec::with_capacity(ROUNDS), 0.0);
    for _ in 0..ROUNDS {
        let started = Instant::now();
        for angles in places {
            let (tip, jacobian) = arm.chain.jacobian(&SVector::from(*angles))?;
            sum += tip.translation().x + jacobian[(0, 0)];
        }
        rounds.push(1e6 * started.elapsed().as_secs_f64() / places.len() as f64);
    }
    ensure!(std::hint::black_box(sum).is_finite(), "forward kinematics gave {sum}");
    quantile(&rounds, 0.5).context("there are rounds")
}

fn pinocchio(arm: &Arm, places: &[JointValues]) -> anyhow::Result<Option<Peer>> {
    let is_there = Command::new("python")
        .args(["-c", "import pinocchio"])
        .stderr(Stdio::null())
        .status();
    if !is_there.is_ok_and(|status| status.success()) {
        eprintln!("SKIPPED: python with pinocchio (`pin`) is missing (cargo xtask setup)");
        return Ok(None);
    }
    let mut peer = ask(places)?;
    ensure!(!peer.tips.is_empty(), "the peer told no positions of the tool");
    for (tip, angles) in peer.tips.iter().zip(places) {
        let ours = arm.chain.forward(&SVector::from(*angles))?.translation();
        peer.apart_m = peer.apart_m.max((Vector3::from(*tip) - ours).norm());
    }
    Ok(Some(peer))
}

/// Sends all angles as little-endian 64-bit numbers.
fn ask(places: &[JointValues]) -> anyhow::Result<Peer> {
    let mut peer = Command::new("python")
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("peers/motion_peer.py"))
        .arg(urdf("xarm7.urdf"))
        .arg(ROUNDS.to_string())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()?;
    let numbers: Vec<u8> = places.iter().flatten().flat_map(|angle| angle.to_le_bytes()).collect();
    let mut input = peer.stdin.take().context("the peer has an input")?;
    input.write_all(&numbers)?;
    drop(input);
    let output = peer.wait_with_output()?;
    ensure!(output.status.success(), "the peer failed");
    serde_json::from_slice(&output.stdout).context("the peer tells one JSON object")
}
