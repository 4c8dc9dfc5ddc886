//! One capture after the other: played, solved, planned on, and compared with what was recorded of it.

use anyhow::anyhow;
use ros::Node;

use super::Nodes;
use super::bench::Bench;
use super::compare;
use super::outcome::Outcome;
use super::pictures::Pictures;
use super::settings::Settings;
use crate::bag::captures::{Capture, Captures};
use crate::bag::{open, print_json};
use crate::failure::Failure;
use crate::nodes::Running;

/// Resolves the captures that are asked for; an error when one fails or differs.
pub(super) async fn every_capture(
    nodes: &Nodes<'_>,
    settings: &Settings,
    running: &mut Running,
) -> Result<(), Failure> {
    let arguments = nodes.arguments;
    let bag = open(&arguments.bag)?;
    let captures = selected(Captures::find(&bag)?.captures, arguments.cycle.as_deref())?;
    let pictures = arguments
        .png
        .as_deref()
        .map(|folder| Pictures::new(folder, &bag, settings))
        .transpose()?;
    settings.start_nodes(nodes, running).await?;
    let node = Node::start(nodes.options("replay")).await.map_err(Failure::usage)?;
    let mut bench = Bench::new(nodes, settings, &bag, &node, &captures)?;
    let mut outcomes = Vec::new();
    for capture in &captures {
        let (outcome, results) = bench.resolve(capture, running).await?;
        if let Some(pictures) = &pictures {
            pictures.write(capture, &results)?;
        }
        if !arguments.json {
            println!("{}", outcome.for_people());
        }
        outcomes.push(outcome);
    }
    node.shutdown().await;
    if arguments.json {
        print_json(&outcomes)?;
    }
    verdict(&outcomes)
}

fn selected(captures: Vec<Capture>, asked: Option<&str>) -> Result<Vec<Capture>, Failure> {
    let known: Vec<String> = captures
        .iter()
        .map(|own| format!("{} ({})", own.number, own.id))
        .collect();
    if captures.is_empty() {
        return Err(anyhow!("the bag holds no capture").into());
    }
    let Some(asked) = asked else { return Ok(captures) };
    let is_it = |capture: &Capture| capture.id == asked || capture.number.to_string() == asked;
    let found: Vec<Capture> = captures.into_iter().filter(is_it).collect();
    if found.is_empty() {
        let known = known.join(", ");
        return Err(Failure::usage(anyhow!("no capture {asked} in the bag; it has {known}")));
    }
    Ok(found)
}

fn verdict(outcomes: &[Outcome]) -> Result<(), Failure> {
    let named = |is_so: fn(&Outcome) -> bool| {
        let names = outcomes.iter().filter(|outcome| is_so(outcome));
        names.map(|outcome| outcome.id.clone()).collect::<Vec<_>>()
    };
    let failed = named(|outcome| outcome.problem.is_some() || outcome.is_uncompared());
    if !failed.is_empty() {
        return Err(anyhow!("not resolved and compared as recorded: {}", failed.join(", ")).into());
    }
    let different = named(Outcome::differs);
    if different.is_empty() {
        return Ok(());
    }
    let tolerance = compare::tolerance();
    Err(anyhow!(
        "not what was recorded: {}; tolerance: {tolerance}",
        different.join(", ")
    )
    .into())
}
