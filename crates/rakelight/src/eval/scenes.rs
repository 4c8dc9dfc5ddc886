//! Captures with truth: which, under what lights, and where pictures of them go.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use calibration_files::LightsFile;
use clap::Args;
use imaging::{Image, encode_png};
use photometric::{
    CalibrationOptions, Capture, LightRig, PixelRays, PolynomialRig, SensorNoise, TargetView, calibrate_lights,
};
use rig_scenes::{CapturedView, SceneFolder, Truth, find_scenes};

use crate::failure::Failure;

/// What all evaluations on captures take.
#[derive(Args)]
pub(super) struct SceneArguments {
    /// Folder of captures with truth: scenes two folders below, or one scene itself.
    #[arg(long, value_name = "DIR")]
    truth: PathBuf,
    /// Calibration of the lights; without it they are calibrated from the hemispheres below the folder.
    #[arg(long, value_name = "FILE")]
    lights: Option<PathBuf>,
    /// Only scenes of this name, such as `octagon2`.
    #[arg(long, value_name = "NAME")]
    only: Option<String>,
    /// Tell the figures as one JSON object.
    #[arg(long)]
    pub(super) json: bool,
    /// Write pictures of what was found, of the truth and of the difference into this folder.
    #[arg(long, value_name = "DIR")]
    png: Option<PathBuf>,
}

/// The scenes and their lights.
pub(super) struct Scenes<'a> {
    arguments: &'a SceneArguments,
    folders: Vec<SceneFolder>,
    pub(super) lights: Lights,
}

/// The lights, and the published system's models of them.
pub(super) struct Lights {
    pub(super) rig: LightRig,
    pub(super) polynomials: PolynomialRig,
}

/// One view of a scene.
pub(super) struct Subject<'a> {
    pub(super) scene: &'a str,
    pub(super) view: &'a CapturedView,
    pub(super) truth: &'a Truth,
    pub(super) capture: Capture<'a>,
    pub(super) lights: &'a Lights,
    png: Option<&'a Path>,
}

impl SceneArguments {
    /// Reads the scenes' descriptions and reads or calibrates the lights.
    pub(super) fn open(&self) -> Result<Scenes<'_>, Failure> {
        if let Some(folder) = &self.png {
            fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
        }
        let paths = find_scenes(&self.truth).map_err(Failure::usage)?;
        let scenes = paths.iter().map(|path| SceneFolder::open(path));
        let scenes = scenes.collect::<Result<Vec<_>, _>>().map_err(Failure::usage)?;
        let lights = match &self.lights {
            Some(path) => read(path)?,
            None => calibrated(&scenes)?,
        };
        Ok(Scenes {
            arguments: self,
            folders: scenes,
            lights,
        })
    }
}

impl Scenes<'_> {
    /// One row for each view of an object that has truth.
    ///
    /// # Errors
    /// That of `evaluate`; no such view.
    pub(super) fn rows<T>(
        &self,
        mut evaluate: impl FnMut(&Subject<'_>) -> anyhow::Result<T>,
    ) -> Result<Vec<T>, Failure> {
        let SceneArguments { truth, only, png, .. } = self.arguments;
        let wanted = |scene: &&SceneFolder| only.as_ref().is_none_or(|name| scene.name() == *name);
        let objects = self.folders.iter().filter(|scene| scene.hemisphere().is_none());
        let mut rows = Vec::new();
        for scene in objects.filter(wanted) {
            let name = scene.name();
            for view in &scene.views()? {
                let Some(truth) = &view.truth else { continue };
                let rays = PixelRays::new(&view.view.camera);
                rows.push(evaluate(&Subject {
                    scene: &name,
                    view,
                    truth,
                    capture: capture(view, &rays, &self.lights.rig),
                    lights: &self.lights,
                    png: png.as_deref(),
                })?);
            }
        }
        if rows.is_empty() {
            return Err(anyhow!("no scene with truth was found below {}", truth.display()).into());
        }
        Ok(rows)
    }
}

impl Subject<'_> {
    /// Writes a picture, if pictures are wanted.
    pub(super) fn picture(
        &self,
        what: &str,
        draw: impl FnOnce() -> anyhow::Result<Image<[u8; 3]>>,
    ) -> anyhow::Result<()> {
        let Some(folder) = self.png else { return Ok(()) };
        let path = folder.join(format!("{}_{}_{what}.png", self.scene, self.view.camera));
        fs::write(&path, encode_png(&draw()?)?).with_context(|| format!("cannot write {}", path.display()))
    }
}

fn capture<'a>(view: &'a CapturedView, rays: &'a PixelRays, rig: &'a LightRig) -> Capture<'a> {
    Capture {
        stack: &view.stack,
        view: &view.view,
        rays,
        rig,
        noise: SensorNoise::RIG,
    }
}

fn read(path: &Path) -> Result<Lights, Failure> {
    let rig = LightsFile::read(path).and_then(|file| file.rig());
    let rig = rig
        .with_context(|| format!("{}", path.display()))
        .map_err(Failure::usage)?;
    let polynomials = PolynomialRig::from_panels(&rig);
    Ok(Lights { rig, polynomials })
}

/// The lights from every hemisphere among the scenes.
fn calibrated(scenes: &[SceneFolder]) -> Result<Lights, Failure> {
    let targets: Vec<&SceneFolder> = scenes.iter().filter(|scene| scene.hemisphere().is_some()).collect();
    if targets.is_empty() {
        let problem = anyhow!("no captures of hemispheres among the scenes: give the lights by --lights FILE");
        return Err(Failure::usage(problem));
    }
    let mut captures = Vec::new();
    for scene in targets {
        for view in scene.views()? {
            captures.push((scene.name(), PixelRays::new(&view.view.camera), view));
        }
    }
    let view = |capture| {
        let (placement, rays, captured): &(String, PixelRays, CapturedView) = capture;
        TargetView {
            placement,
            camera: &captured.camera,
            stack: &captured.stack,
            view: &captured.view,
            rays,
        }
    };
    let calibration = calibrate_lights(&captures.iter().map(view).collect::<Vec<_>>(), &CalibrationOptions::RIG)?;
    match calibration.failure {
        None => Ok(Lights {
            rig: calibration.rig,
            polynomials: calibration.polynomials,
        }),
        Some(reason) => Err(anyhow!("the calibration failed: {reason}").into()),
    }
}
