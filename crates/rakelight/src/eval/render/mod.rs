//! `rakelight eval render`: the simulated cameras' images against path-traced captures of the same scenes.
//!
//! A folder of captures holds scenes (`*/*/scene.json`), a scene two views with one image per light, an image of the
//! ambient light alone, and truth beside them. A view is rendered from the same place, scaled to the capture's digital
//! numbers and compared where the truth says what is to be seen there.

mod comparison;
mod description;
mod npz;
mod picture;
mod prints;
mod report;
mod score;
mod truth;

use std::path::{Path, PathBuf};

use ::sim::render::{RenderOptions, render};
use anyhow::{Context, anyhow, ensure};
use clap::Args;

use crate::failure::Failure;
use comparison::Comparison;
use description::Description;
use report::{Report, ViewReport};
use truth::Truth;

#[derive(Args)]
pub(crate) struct Arguments {
    /// Folder of captures with truth: scenes two folders below, or one scene itself.
    #[arg(long, value_name = "DIR")]
    truth: PathBuf,
    /// Only scenes whose path ends in this name, such as `octagon2`.
    #[arg(long, value_name = "NAME")]
    only: Option<String>,
    /// Render and compare at this fraction of the resolution: N x N pixels become one.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=16))]
    bin: u16,
    /// Write a picture of each view into this folder: ours, truth and difference, a row per light.
    #[arg(long, value_name = "DIR")]
    png: Option<PathBuf>,
    /// Fail when the difference on directly lit object pixels is larger, percent of the lit signal.
    #[arg(long, value_name = "PERCENT", default_value_t = 5.0)]
    limit: f64,
    /// Tell the figures as one JSON object.
    #[arg(long)]
    json: bool,
}

pub(crate) async fn run(arguments: Arguments) -> Result<(), Failure> {
    let scenes = scenes(&arguments.truth, arguments.only.as_deref()).map_err(Failure::usage)?;
    if let Some(folder) = &arguments.png {
        std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    }
    let (json, limit) = (arguments.json, arguments.limit);
    let report = tokio::task::spawn_blocking(move || evaluate(&scenes, &arguments)).await??;
    if json {
        println!("{}", serde_json::to_string_pretty(&report)?);
    } else {
        print!("{}", report.overall_for_people());
    }
    let found = report.direct_lit_rms();
    if found <= limit {
        return Ok(());
    }
    Err(Failure::from(anyhow!(
        "directly lit pixels differ by {found:.2} % of the lit signal, allowed are {limit} %"
    )))
}

/// Folders with a `scene.json`, in the order of their names.
fn scenes(truth: &Path, only: Option<&str>) -> anyhow::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    collect(truth, 2, &mut found)?;
    found.retain(|scene| only.is_none_or(|name| scene.ends_with(name)));
    found.sort();
    let wanted = only.map_or_else(String::new, |name| format!(" named {name}"));
    ensure!(
        !found.is_empty(),
        "no scene{wanted} in {}: looked for scene.json there and up to two folders below",
        truth.display()
    );
    Ok(found)
}

fn collect(folder: &Path, depth: usize, found: &mut Vec<PathBuf>) -> anyhow::Result<()> {
    if folder.join("scene.json").is_file() {
        found.push(folder.to_owned());
        return Ok(());
    }
    let entries = std::fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))?;
    for entry in entries {
        let path = entry
            .with_context(|| format!("cannot read {}", folder.display()))?
            .path();
        if depth > 0 && path.is_dir() {
            collect(&path, depth - 1, found)?;
        }
    }
    Ok(())
}

fn evaluate(scenes: &[PathBuf], arguments: &Arguments) -> anyhow::Result<Report> {
    let mut report = Report::default();
    if !arguments.json {
        print!("{}", report::heading());
    }
    for folder in scenes {
        let description = Description::read(folder)?;
        for index in 0..description.views.len() {
            let view = compare(folder, &description, index, arguments)
                .with_context(|| format!("{}, {}", folder.display(), description.views[index].camera))?;
            if !arguments.json {
                println!("{}", view.for_people());
            }
            report.add(view);
        }
    }
    Ok(report)
}

/// Renders a view and compares it with its capture.
fn compare(
    folder: &Path,
    description: &Description,
    index: usize,
    arguments: &Arguments,
) -> anyhow::Result<ViewReport> {
    let bin = usize::from(arguments.bin);
    let entry = &description.views[index];
    let (scene, view) = (description.scene(folder)?, entry.view(bin)?);
    let started = std::time::Instant::now();
    let rendered = render(&scene, &view, &RenderOptions { seed: 1 })?;
    let seconds = started.elapsed().as_secs_f64();
    let truth = Truth::read(&folder.join(&entry.camera), entry.size)?;
    let comparison = Comparison::new(description, entry, &truth, &rendered, bin)?;
    let name = report::scene_name(folder);
    if let Some(out) = &arguments.png {
        let path = out.join(format!("{name}_{}.png", entry.camera));
        picture::write(&comparison, &path)?;
    }
    Ok(ViewReport::new(
        name,
        entry.camera.clone(),
        seconds,
        comparison.scores(),
    ))
}
