//! What can be set from outside.

use std::ops::RangeInclusive;
use std::time::Duration;

use geometry::nalgebra::Vector3;
use grasp::{Cup, Limits, PlanOptions, SearchOptions, Way};
use ros::Node;
use ros::parameters::{Parameter, ParameterHandle};

use crate::error::Error;

/// The executor's.
const HOME: [f64; 7] = [0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0];

pub(crate) struct Parameters {
    pub(crate) cameras: Vec<String>,
    pub(crate) base_frame_id: ParameterHandle<String>,
    pub(crate) keep_captures: ParameterHandle<i64>,
    result_timeout: ParameterHandle<f64>,
    cup: CupParameters,
    work: WorkParameters,
    limits: LimitParameters,
    pregrasp_distance: ParameterHandle<f64>,
    retreat_height: ParameterHandle<f64>,
    most_grasps: ParameterHandle<i64>,
    pub(crate) arm_description: String,
    pub(crate) home: Vec<f64>,
}

/// Diameter of the gripper in `urdf/xarm7.urdf` (76 x 92 mm), and its distance from the lip: 12 mm, of which the lip may
/// give 5 while it is pressed on; metres.
const BODY: [f64; 2] = [0.12, 0.007];

struct CupParameters {
    diameter: ParameterHandle<f64>,
    compliance: ParameterHandle<f64>,
    stem_diameter: ParameterHandle<f64>,
    stem_length: ParameterHandle<f64>,
    body_diameter: ParameterHandle<f64>,
    body_distance: ParameterHandle<f64>,
}

/// Where objects are and from where they may be taken.
struct WorkParameters {
    table_height: ParameterHandle<f64>,
    highest: ParameterHandle<f64>,
    directions: ParameterHandle<Vec<f64>>,
    cone: ParameterHandle<f64>,
}

struct LimitParameters {
    edge_share: ParameterHandle<f64>,
    confidence: ParameterHandle<f64>,
    border: ParameterHandle<f64>,
    clearance: ParameterHandle<f64>,
    uncertainty: ParameterHandle<f64>,
    outline: ParameterHandle<f64>,
}

/// What one plan is made with.
#[derive(Debug, Clone)]
pub(crate) struct Settings {
    pub(crate) cup: Cup,
    pub(crate) options: PlanOptions,
    pub(crate) way: Way,
    pub(crate) most_grasps: usize,
}

impl Parameters {
    pub(crate) fn declare(node: &Node) -> Result<Self, Error> {
        let declare = Declare(node);
        let parameters = node.parameters();
        let cameras = Parameter::strings("cameras", ["c1".to_owned(), "c2".to_owned()])
            .read_only()
            .describe("One camera or two whose results are planned on; each is a namespace below the node's");
        let base = Parameter::string("base_frame_id", "link_base").describe("Frame of normals and grasps");
        let kept = Parameter::integer("keep_captures", 2)
            .range(1..=16)
            .describe("Captures that can be planned on; each takes up to 125 MB");
        let most = Parameter::integer("most_grasps", 20)
            .range(1..=1000)
            .describe("More grasps than this, the best ones, are not given");
        let description = Parameter::string("arm_description", "")
            .read_only()
            .describe("URDF of the arm with its tool; empty: the xArm7 with the vacuum cup");
        let home = Parameter::floats("home", HOME)
            .unit("rad")
            .read_only()
            .describe("Joint angles near which the arm is to grasp: the executor's home");
        let declared = Self {
            cameras: parameters.declare(cameras)?.get(),
            base_frame_id: parameters.declare(base)?,
            keep_captures: parameters.declare(kept)?,
            result_timeout: declare.seconds(
                "result_timeout",
                3.0,
                "Results that have not come after this long are missing",
            )?,
            cup: CupParameters::declare(&declare)?,
            work: WorkParameters::declare(&declare)?,
            limits: LimitParameters::declare(&declare)?,
            pregrasp_distance: declare.metres(
                "pregrasp_distance",
                0.05,
                0.005..=0.5,
                "From where the approach starts to the contact, along the surface's normal",
            )?,
            retreat_height: declare.metres("retreat_height", 0.1, 0.0..=0.5, "How far up the object is lifted")?,
            most_grasps: parameters.declare(most)?,
            arm_description: parameters.declare(description)?.get(),
            home: parameters.declare(home)?.get(),
        };
        parameters.seal()?;
        Ok(declared)
    }

    pub(crate) fn result_timeout(&self) -> Duration {
        Duration::from_secs_f64(self.result_timeout.get())
    }

    /// As they are now; refuses lists of a wrong length.
    pub(crate) fn settings(&self) -> Result<Settings, Error> {
        if !(1..=2).contains(&self.cameras.len()) {
            return Err(Error::Value {
                name: "cameras",
                reason: format!("{} cameras, allowed: 1 or 2", self.cameras.len()),
            });
        }
        let cup = &self.cup;
        Ok(Settings {
            cup: Cup {
                diameter: cup.diameter.get(),
                compliance: cup.compliance.get(),
                stem_diameter: cup.stem_diameter.get(),
                stem_length: cup.stem_length.get(),
                body_diameter: cup.body_diameter.get(),
                body_distance: cup.body_distance.get(),
            },
            options: self.options()?,
            way: Way {
                pregrasp_distance: self.pregrasp_distance.get(),
                retreat_height: self.retreat_height.get(),
            },
            most_grasps: self.most_grasps.get() as usize,
        })
    }

    fn options(&self) -> Result<PlanOptions, Error> {
        let (work, limits) = (&self.work, &self.limits);
        Ok(PlanOptions {
            directions: sides(&work.directions.get())?,
            table_height: work.table_height.get(),
            highest: work.highest.get(),
            search: SearchOptions {
                cone: work.cone.get(),
                ..SearchOptions::default()
            },
            limits: Limits {
                edge_share: limits.edge_share.get(),
                confidence: limits.confidence.get(),
                border: limits.border.get(),
                clearance: limits.clearance.get(),
                uncertainty: limits.uncertainty.get(),
                outline: limits.outline.get(),
                ..Limits::default()
            },
            ..PlanOptions::default()
        })
    }
}

/// Sides to come from, out of the object, for directions to go in.
fn sides(directions: &[f64]) -> Result<Vec<Vector3<f64>>, Error> {
    let (triples, rest) = directions.as_chunks::<3>();
    let sides: Vec<Vector3<f64>> = triples.iter().map(|direction| -Vector3::from(*direction)).collect();
    let is_direction = |side: &Vector3<f64>| (1e-6..f64::INFINITY).contains(&side.norm());
    if !rest.is_empty() || sides.is_empty() || !sides.iter().all(is_direction) {
        return Err(Error::Value {
            name: "directions",
            reason: format!(
                "{directions:?}; allowed: three finite numbers for each direction, longer than 1e-6, at least one"
            ),
        });
    }
    Ok(sides)
}

impl CupParameters {
    fn declare(declare: &Declare<'_>) -> Result<Self, Error> {
        let cup = Cup::default();
        let metres = |name, default, range, what| declare.metres(name, default, range, what);
        Ok(Self {
            diameter: metres("cup.diameter", cup.diameter, 0.002..=0.2, "Of the cup's lip")?,
            compliance: metres(
                "cup.compliance",
                cup.compliance,
                0.0..=0.1,
                "How far the lip gives before it leaks, at most the cup's radius",
            )?,
            stem_diameter: metres(
                "cup.stem_diameter",
                cup.stem_diameter,
                0.001..=0.3,
                "Of everything that follows the cup into the work",
            )?,
            stem_length: metres(
                "cup.stem_length",
                cup.stem_length,
                0.0..=0.5,
                "From the lip to what need not come near the object",
            )?,
            body_diameter: metres(
                "cup.body_diameter",
                BODY[0],
                0.0..=0.5,
                "Of a cylinder that holds the gripper; what is in its way is seen, 0 takes none",
            )?,
            body_distance: metres(
                "cup.body_distance",
                BODY[1],
                0.0..=0.5,
                "From the lip to where the gripper begins",
            )?,
        })
    }
}

impl WorkParameters {
    fn declare(declare: &Declare<'_>) -> Result<Self, Error> {
        let usual = PlanOptions::default();
        let directions: Vec<f64> = usual
            .directions
            .iter()
            .flat_map(|side| side.data.0[0].map(|number| 0.0 - number))
            .collect();
        let directions = Parameter::floats("directions", directions).describe(
            "Three numbers for each direction in which the cup may move onto an object, base frame, any length",
        );
        Ok(Self {
            table_height: declare.metres(
                "table_height",
                usual.table_height,
                -1.0..=1.0,
                "Of the table's plane, base frame",
            )?,
            highest: declare.metres(
                "highest",
                usual.highest,
                0.001..=1.0,
                "No object stands higher over the table",
            )?,
            directions: declare.0.parameters().declare(directions)?,
            cone: declare.0.parameters().declare(
                Parameter::float("cone", usual.search.cone)
                    .unit("rad")
                    .range(0.0..=1.5)
                    .describe("Largest angle between approach and the nearest of the directions"),
            )?,
        })
    }
}

impl LimitParameters {
    fn declare(declare: &Declare<'_>) -> Result<Self, Error> {
        let limits = Limits::default();
        let share = |name, default, what| declare.share(name, default, what);
        let metres = |name, default, range, what| declare.metres(name, default, range, what);
        Ok(Self {
            edge_share: share(
                "limits.edge_share",
                limits.edge_share,
                "Largest share of the footprint that edges cover",
            )?,
            confidence: share(
                "limits.confidence",
                limits.confidence,
                "Least mean confidence in the footprint",
            )?,
            border: metres(
                "limits.border",
                limits.border,
                0.0..=0.05,
                "Least distance from the footprint's rim to the patch's border",
            )?,
            clearance: metres(
                "limits.clearance",
                limits.clearance,
                -0.01..=0.1,
                "Least distance of the lip from the table",
            )?,
            uncertainty: metres(
                "limits.uncertainty",
                limits.uncertainty,
                1e-4..=0.05,
                "Largest standard deviation of the contact along the approach",
            )?,
            outline: share(
                "limits.outline",
                limits.outline,
                "Least share of a thin object's outline on which edges must be",
            )?,
        })
    }
}

/// For parameters of one kind.
struct Declare<'a>(&'a Node);

impl Declare<'_> {
    fn metres(
        &self,
        name: &str,
        default: f64,
        range: RangeInclusive<f64>,
        what: &str,
    ) -> Result<ParameterHandle<f64>, Error> {
        let parameter = Parameter::float(name, default).unit("m").range(range).describe(what);
        Ok(self.0.parameters().declare(parameter)?)
    }

    fn seconds(&self, name: &str, default: f64, what: &str) -> Result<ParameterHandle<f64>, Error> {
        let parameter = Parameter::float(name, default)
            .unit("s")
            .range(0.0..=600.0)
            .describe(what);
        Ok(self.0.parameters().declare(parameter)?)
    }

    fn share(&self, name: &str, default: f64, what: &str) -> Result<ParameterHandle<f64>, Error> {
        let parameter = Parameter::float(name, default).range(0.0..=1.0).describe(what);
        Ok(self.0.parameters().declare(parameter)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cup_comes_from_the_side_opposite_to_its_way() {
        let sides = sides(&[0.0, 0.0, -2.0, 1.0, 0.0, 0.0]).expect("two directions");
        assert_eq!(sides, [Vector3::new(0.0, 0.0, 2.0), Vector3::new(-1.0, 0.0, 0.0)]);
    }

    #[test]
    fn lists_that_are_no_directions_are_refused() {
        for wrong in [
            &[][..],
            &[1.0, 0.0],
            &[0.0; 3],
            &[f64::NAN, 0.0, 1.0],
            &[0.0, 0.0, 1.0, 2.0],
        ] {
            let text = sides(wrong).expect_err("no directions").to_string();
            assert!(text.starts_with("parameter directions: ["), "{text}");
        }
    }
}
