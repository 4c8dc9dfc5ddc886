//! Figures for people and programs.

use std::fmt::Write;
use std::path::Path;

use serde::Serialize;

use super::score::{Score, Sums};
use super::truth::NAMES;

/// Scores of directly lit, shadowed and room pixels.
#[derive(Serialize)]
struct Scores {
    direct_lit: Option<Score>,
    shadowed: Option<Score>,
    room: Option<Score>,
}

impl Scores {
    fn new([direct_lit, shadowed, room]: &[Sums; 3]) -> Self {
        Self {
            direct_lit: direct_lit.score(),
            shadowed: shadowed.score(),
            room: room.score(),
        }
    }

    fn for_people(&self) -> String {
        let [lit, shadowed, room] = [&self.direct_lit, &self.shadowed, &self.room].map(|score| match score {
            Some(score) => format!(
                "{:6.2} {:+6.2} {:6.2} ({:5.2})",
                score.rms_percent, score.bias_percent, score.median_percent, score.noise_percent
            ),
            None => format!("{:>28}", "-"),
        });
        format!("{lit}  {shadowed}  {room}")
    }
}

/// One view of one scene.
#[derive(Serialize)]
pub(super) struct ViewReport {
    scene: String,
    camera: String,
    render_seconds: f64,
    /// All panels' images together.
    panels: Scores,
    /// Image by image.
    images: Vec<(&'static str, Scores)>,
    #[serde(skip)]
    sums: Vec<[Sums; 3]>,
}

impl ViewReport {
    pub(super) fn new(scene: String, camera: String, render_seconds: f64, sums: Vec<[Sums; 3]>) -> Self {
        Self {
            scene,
            camera,
            render_seconds,
            panels: Scores::new(&together(&sums[..7])),
            images: NAMES.into_iter().zip(sums.iter().map(Scores::new)).collect(),
            sums,
        }
    }

    pub(super) fn for_people(&self) -> String {
        let name = format!("{} {}", self.scene, self.camera);
        format!("{name:16} {}  {:5.1} s", self.panels.for_people(), self.render_seconds)
    }
}

fn together(images: &[[Sums; 3]]) -> [Sums; 3] {
    let mut all: [Sums; 3] = Default::default();
    for image in images {
        for (all, image) in all.iter_mut().zip(image) {
            all.add_image(image);
        }
    }
    all
}

/// All views.
#[derive(Default, Serialize)]
pub(super) struct Report {
    views: Vec<ViewReport>,
    overall: Option<Scores>,
    overall_by_image: Vec<(&'static str, Scores)>,
}

impl Report {
    pub(super) fn add(&mut self, view: ViewReport) {
        self.views.push(view);
        let images = |of: usize| self.views.iter().map(|view| view.sums[of].clone()).collect::<Vec<_>>();
        let by_image: Vec<[Sums; 3]> = (0..NAMES.len()).map(|image| together(&images(image))).collect();
        let panels: Vec<[Sums; 3]> = (0..7).flat_map(images).collect();
        self.overall = Some(Scores::new(&together(&panels)));
        self.overall_by_image = NAMES.into_iter().zip(by_image.iter().map(Scores::new)).collect();
    }

    /// Over all panels' images; infinite when nothing was compared.
    pub(super) fn direct_lit_rms(&self) -> f64 {
        let score = self.overall.as_ref().and_then(|overall| overall.direct_lit.as_ref());
        score.map_or(f64::INFINITY, |score| score.rms_percent)
    }

    pub(super) fn overall_for_people(&self) -> String {
        let mut text = String::new();
        for (name, scores) in &self.overall_by_image {
            let _ = writeln!(text, "{:16} {}", format!("all, {name}"), scores.for_people());
        }
        if let Some(overall) = &self.overall {
            let _ = writeln!(text, "{:16} {}", "all, L1 to L7", overall.for_people());
        }
        text
    }
}

/// Says what the columns are.
pub(super) fn heading() -> String {
    let columns = "   rms   bias median (noise)";
    format!(
        "Rendered minus captured, percent of the mean signal of the same pixels of an image (median: of each pixel's \
         own);\nnoise is what the captures' sensor adds. Rows of one view: L1 to L7 together.\n\n{:16} {:28}  {:28}  {}\
         \n{:16} {columns}  {columns}  {columns}  render\n",
        "", "object, directly lit", "object, shadowed", "mat and table", ""
    )
}

/// The last part of a scene's path.
pub(super) fn scene_name(folder: &Path) -> String {
    let name = folder.canonicalize().ok();
    let name = name.as_deref().unwrap_or(folder).file_name();
    name.map_or_else(|| "scene".to_owned(), |name| name.to_string_lossy().into_owned())
}
