//! What the command line says in place of the world file.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{anyhow, bail};
use sim::world::{Camera, World};

/// How clients may name a simulated camera: the serial number after maker and model.
const NAME_PREFIX: &str = "Rakelight-Simulated-";

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Overrides {
    pub(super) light_port: Option<PathBuf>,
    pub(super) cameras: Vec<CameraPlace>,
    pub(super) binnings: Vec<CameraBinning>,
    pub(super) arm: Option<SocketAddrV4>,
}

/// `c1=2`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct CameraBinning {
    camera: String,
    binning: u32,
}

impl FromStr for CameraBinning {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> anyhow::Result<Self> {
        let parts = text.split_once('=');
        let binning = parts.and_then(|(_, binning)| binning.parse().ok());
        match (parts, binning) {
            (Some((camera, _)), Some(binning @ (1 | 2 | 4))) if !camera.is_empty() => Ok(Self {
                camera: camera.to_owned(),
                binning,
            }),
            _ => bail!("{text:?} is not of the form c1=2; allowed binnings: 1, 2, 4"),
        }
    }
}

/// `c1=127.0.0.9`, or `c1=` and a serial number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct CameraPlace {
    camera: String,
    place: Place,
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum Place {
    Address(Ipv4Addr),
    Serial(String),
}

impl FromStr for CameraPlace {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> anyhow::Result<Self> {
        let (camera, place) = text
            .split_once('=')
            .filter(|(camera, place)| !camera.is_empty() && !place.is_empty())
            .ok_or_else(|| anyhow!("{text:?} is not of the form c1=127.0.0.9 or c1=SERIAL"))?;
        let place = match place.parse() {
            Ok(address) => Place::Address(address),
            Err(_) => Place::Serial(place.strip_prefix(NAME_PREFIX).unwrap_or(place).to_owned()),
        };
        Ok(Self {
            camera: camera.to_owned(),
            place,
        })
    }
}

impl Overrides {
    /// The world of a file, but for what the command line says.
    pub(super) fn read(&self, path: &Path) -> anyhow::Result<World> {
        let mut world = World::read(path)?;
        for wanted in &self.cameras {
            let camera = camera(&mut world, "--camera", &wanted.camera)?;
            match &wanted.place {
                Place::Address(address) => camera.address = *address,
                Place::Serial(serial) => camera.serial.clone_from(serial),
            }
        }
        for wanted in &self.binnings {
            camera(&mut world, "--binning", &wanted.camera)?.binning = wanted.binning;
        }
        if let Some(port) = &self.light_port {
            world.lights.port = Some(port.clone());
        }
        if let Some(place) = self.arm {
            let arm = world.arm.as_mut();
            let arm = arm.ok_or_else(|| anyhow!("--arm {place}: the world has no arm"))?;
            (arm.address, arm.ports.control) = (*place.ip(), place.port());
        }
        Ok(world)
    }
}

fn camera<'a>(world: &'a mut World, option: &str, name: &str) -> anyhow::Result<&'a mut Camera> {
    let known: Vec<String> = world.cameras.iter().map(|camera| camera.name.clone()).collect();
    let found = world.cameras.iter_mut().find(|camera| camera.name == name);
    found.ok_or_else(|| anyhow!("{option} {name}: known are {}", known.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(cameras: &[&str]) -> anyhow::Result<World> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("world.yaml");
        std::fs::write(&path, "lights: {port: here}")?;
        let overrides = Overrides {
            light_port: Some("there".into()),
            cameras: cameras.iter().map(|text| text.parse()).collect::<Result<_, _>>()?,
            binnings: vec!["c2=4".parse()?],
            arm: None,
        };
        overrides.read(&path)
    }

    #[test]
    fn cameras_and_port_are_where_the_command_line_says() {
        let world = read(&["c1=127.9.9.9", "c2=Rakelight-Simulated-OTHER"]).unwrap();
        assert_eq!(world.lights.port, Some(PathBuf::from("there")));
        assert_eq!((world.cameras[0].binning, world.cameras[1].binning), (1, 4));
        assert_eq!(world.cameras[0].address, Ipv4Addr::new(127, 9, 9, 9));
        assert_eq!(
            (world.cameras[0].serial.as_str(), world.cameras[1].serial.as_str()),
            ("RAKELIGHT-C1", "OTHER")
        );
    }

    #[test]
    fn the_arm_is_where_the_command_line_says() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("world.yaml");
        let overrides = Overrides {
            light_port: None,
            cameras: Vec::new(),
            binnings: Vec::new(),
            arm: Some("127.9.9.8:5030".parse().unwrap()),
        };
        std::fs::write(&path, "arm: {vacuum: 2}").unwrap();
        let arm = overrides.read(&path).unwrap().arm.unwrap();
        assert_eq!((arm.address, arm.ports.control), (Ipv4Addr::new(127, 9, 9, 8), 5030));
        std::fs::write(&path, "seed: 1").unwrap();
        let error = overrides.read(&path).unwrap_err().to_string();
        assert_eq!(error, "--arm 127.9.9.8:5030: the world has no arm");
    }

    #[test]
    fn cameras_that_are_not_there_are_refused_with_those_that_are() {
        assert_eq!(
            read(&["c9=127.9.9.9"]).unwrap_err().to_string(),
            "--camera c9: known are c1, c2"
        );
        let error = read(&["c1"]).unwrap_err().to_string();
        assert_eq!(error, "\"c1\" is not of the form c1=127.0.0.9 or c1=SERIAL");
        for text in ["c1=3", "=2", "c1"] {
            let error = text.parse::<CameraBinning>().unwrap_err().to_string();
            assert!(error.ends_with("allowed binnings: 1, 2, 4"), "{error}");
        }
    }
}
