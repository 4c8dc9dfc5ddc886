//! Pictures of the target, from bags or folders, and what is found in them.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use camera_calibration::{CharucoTarget, DetectedCorner, TargetDetector};
use clap::Args;
use geometry::{PinholeCamera, RigidTransform};
use imaging::{DecodedPng, Image, decode_png};
use recording::Bag;
use serde::Deserialize;

use crate::captured::{self, Picture};
use crate::failure::Failure;

/// In a folder of pictures, what they show.
const POSES: &str = "poses.json";

/// The printed board.
#[derive(Args)]
pub(super) struct Board {
    /// Squares side by side.
    #[arg(long, value_name = "N", default_value_t = CharucoTarget::A4.columns())]
    columns: usize,
    /// Squares one below the other.
    #[arg(long, value_name = "N", default_value_t = CharucoTarget::A4.rows())]
    rows: usize,
    /// Side of a square, metres: measure it on the print.
    #[arg(long, value_name = "METRES", default_value_t = CharucoTarget::A4.square())]
    square: f64,
    /// Side of a marker, metres; 0.6 squares when it is not said.
    #[arg(long, value_name = "METRES")]
    marker: Option<f64>,
}

impl Board {
    pub(super) fn target(&self) -> Result<CharucoTarget, Failure> {
        let part = CharucoTarget::A4.marker() / CharucoTarget::A4.square();
        let marker = self.marker.unwrap_or(part * self.square);
        CharucoTarget::new(self.columns, self.rows, self.square, marker).map_err(Failure::usage)
    }
}

/// Where pictures are.
#[derive(Args)]
pub(super) struct Sources {
    /// Bag with captures of the target; may be given several times.
    #[arg(long = "bag", value_name = "BAG")]
    bags: Vec<PathBuf>,
    /// Folder of PNG pictures, with `poses.json` for more than one camera or for hand-eye; may be given several times.
    #[arg(long = "images", value_name = "DIR")]
    folders: Vec<PathBuf>,
    /// Panel under which the pictures were taken; 7 is overhead.
    #[arg(long, value_name = "N", default_value_t = 7)]
    light: u8,
    /// Frame of the arm that camera or target are fixed to.
    #[arg(long, value_name = "FRAME", default_value = "link_eef")]
    pub(super) flange: String,
    /// Leave out the picture of this name; may be given several times.
    #[arg(long = "without", value_name = "NAME")]
    without: Vec<String>,
    #[command(flatten)]
    board: Board,
}

/// A picture in which the target was found.
pub(super) struct Shot {
    /// Of the capture: pictures of several cameras have the same.
    pub(super) name: String,
    pub(super) camera: String,
    /// The camera's optical frame.
    pub(super) frame: String,
    pub(super) size: [usize; 2],
    pub(super) corners: Vec<DetectedCorner>,
    /// None, and why: the bag or folder does not say.
    pub(super) lens: anyhow::Result<PinholeCamera>,
    pub(super) base_from_flange: anyhow::Result<RigidTransform>,
    /// Pictures with the same number show the target at the same place.
    pub(super) placement: usize,
}

/// A target and pictures of it.
pub(super) struct Shots {
    pub(super) target: CharucoTarget,
    pub(super) shots: Vec<Shot>,
}

impl Shots {
    /// Names of the cameras, sorted.
    pub(super) fn cameras(&self) -> Vec<String> {
        let mut names: Vec<String> = self.shots.iter().map(|shot| shot.camera.clone()).collect();
        names.sort();
        names.dedup();
        names
    }

    /// A camera's pictures; an error when there is none.
    pub(super) fn of<'a>(&'a self, camera: &str) -> Result<Vec<&'a Shot>, Failure> {
        let own: Vec<&Shot> = self.shots.iter().filter(|shot| shot.camera == camera).collect();
        if own.is_empty() {
            let cameras = self.cameras().join(", ");
            let problem = anyhow!("the target was found in no picture of camera {camera:?}; in those of: {cameras}");
            return Err(Failure::from(problem));
        }
        Ok(own)
    }
}

/// What a folder says of its pictures.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Poses {
    views: Vec<View>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct View {
    /// File in the folder.
    image: PathBuf,
    #[serde(default = "c1")]
    camera: String,
    /// The same for cameras that took a picture at the same time; the file's name when it is not said.
    capture: Option<String>,
    /// x y z (metres) and unit quaternion qx qy qz qw.
    base_from_flange: Option<[f64; 7]>,
    #[serde(default)]
    placement: usize,
}

fn c1() -> String {
    "c1".to_owned()
}

impl Sources {
    /// Looks for the target in every picture and says on standard output where it was found.
    pub(super) fn read(&self) -> Result<Shots, Failure> {
        if self.bags.is_empty() && self.folders.is_empty() {
            return Err(Failure::usage(anyhow!(
                "no pictures: name a --bag or a folder of --images"
            )));
        }
        let target = self.board.target()?;
        let mut finder = Finder {
            detector: TargetDetector::new(&target)?,
            without: &self.without,
            shots: Vec::new(),
            placements: Vec::new(),
        };
        for path in &self.bags {
            self.read_bag(path, &mut finder)?;
        }
        for folder in &self.folders {
            read_folder(folder, &mut finder)?;
        }
        Ok(Shots {
            target,
            shots: finder.shots,
        })
    }

    fn read_bag(&self, path: &Path, finder: &mut Finder<'_>) -> Result<(), Failure> {
        if !path.exists() {
            return Err(Failure::usage(anyhow!("no bag at {}", path.display())));
        }
        let bag = Bag::open(path)?;
        let problems = captured::for_each_picture(&bag, self.light, &self.flange, |picture| {
            finder.take(picture, (path, 0));
            Ok(())
        })
        .with_context(|| format!("{}", path.display()))?;
        for problem in problems {
            eprintln!("{}: {problem}", path.display());
        }
        Ok(())
    }
}

/// Pictures of a folder, in the order of `poses.json` or of their names.
fn read_folder(folder: &Path, finder: &mut Finder<'_>) -> Result<(), Failure> {
    let usage = |error: anyhow::Error| Failure::usage(error.context(folder.display().to_string()));
    let views = views(folder).map_err(usage)?;
    if views.is_empty() {
        return Err(usage(anyhow!("no PNG pictures, and no {POSES}")));
    }
    for view in views {
        let image = read_image(&folder.join(&view.image)).map_err(usage)?;
        let file = view.image.display().to_string();
        let base_from_flange = match view.base_from_flange {
            None => Err(anyhow!("{POSES} has no base_from_flange for {file}")),
            Some([x, y, z, qx, qy, qz, qw]) => RigidTransform::from_quaternion_xyzw([x, y, z], [qx, qy, qz, qw])
                .map(Ok)
                .map_err(|error| usage(anyhow!("{POSES}, base_from_flange of {file}: {error}")))?,
        };
        let picture = Picture {
            id: view.capture.unwrap_or(file),
            frame: format!("{}_optical_frame", view.camera),
            camera: view.camera,
            image,
            lens: Err(anyhow!("a folder of pictures has no camera_info")),
            base_from_flange,
        };
        finder.take(picture, (folder, view.placement));
    }
    Ok(())
}

fn views(folder: &Path) -> anyhow::Result<Vec<View>> {
    let file = folder.join(POSES);
    if file.exists() {
        let text = std::fs::read_to_string(&file).context(POSES)?;
        let poses: Poses = serde_json::from_str(&text).context(POSES)?;
        return Ok(poses.views);
    }
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let name = PathBuf::from(entry?.file_name());
        if name
            .extension()
            .is_some_and(|extension| extension.eq_ignore_ascii_case("png"))
        {
            names.push(name);
        }
    }
    names.sort();
    let view = |image| View {
        image,
        camera: c1(),
        capture: None,
        base_from_flange: None,
        placement: 0,
    };
    Ok(names.into_iter().map(view).collect())
}

fn read_image(path: &Path) -> anyhow::Result<Image<u16>> {
    let what = || path.display().to_string();
    let bytes = std::fs::read(path).with_context(what)?;
    Ok(match decode_png(&bytes).with_context(what)? {
        DecodedPng::Gray16(image) => image,
        DecodedPng::Gray8(image) => image.map(|&value| u16::from(value) * 257),
        DecodedPng::Rgb8(image) => image.map(|&[r, g, b]| (u16::from(r) + u16::from(g) + u16::from(b)) * 85),
    })
}

struct Finder<'a> {
    detector: TargetDetector,
    without: &'a [String],
    shots: Vec<Shot>,
    /// Bag or folder, and its own number.
    placements: Vec<(PathBuf, usize)>,
}

impl Finder<'_> {
    fn take(&mut self, picture: Picture, place: (&Path, usize)) {
        let camera = picture.camera.rsplit('/').next().unwrap_or_default().to_owned();
        if self.without.contains(&picture.id) {
            println!("  {}, {camera}: left out as wished", picture.id);
            return;
        }
        let corners = match self.detector.detect(&picture.image) {
            Ok(corners) => corners,
            Err(reason) => {
                println!("  {}, {camera}: NOT FOUND: {reason}", picture.id);
                return;
            }
        };
        println!("  {}, {camera}: {} corners", picture.id, corners.len());
        let place = (place.0.to_owned(), place.1);
        let known = self.placements.iter().position(|known| *known == place);
        let placement = known.unwrap_or_else(|| {
            self.placements.push(place);
            self.placements.len() - 1
        });
        self.shots.push(Shot {
            name: picture.id,
            camera,
            frame: picture.frame,
            size: [picture.image.width(), picture.image.height()],
            corners,
            lens: picture.lens,
            base_from_flange: picture.base_from_flange,
            placement,
        });
    }
}
