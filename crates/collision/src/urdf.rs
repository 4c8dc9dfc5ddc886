//! Collision shapes and the tree of links, from URDF files.

use geometry::RigidTransform;
use nalgebra::{Point3, UnitQuaternion, Vector3};
use urdf_rs::{Geometry, JointType, Robot};

use crate::error::{CollisionError, require_finite};
use crate::shape::Shape;

/// Links of a file; a longer way up has a loop.
const MOST_LINKS: usize = 1000;
/// A cylinder and two spheres are a capsule if they fit to this, metres: files round to micrometres and microradians.
const SAME: f64 = 1e-4;

/// What becomes of cylinders that are no part of a capsule.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Cylinders {
    /// As they are.
    Flat,
    /// The capsule that holds them: larger at both ends by their radius, but its distances are cheap.
    Rounded,
}

/// In the frame of what carries them.
enum Primitive {
    Cylinder {
        frame: RigidTransform,
        radius: f64,
        length: f64,
    },
    Sphere {
        centre: Point3<f64>,
        radius: f64,
    },
    Shape(Shape),
}

/// A link's collision shapes in the frame `target_from_link` leads to.
///
/// URDF has no capsules that all its readers know, so a cylinder with two spheres of its radius at its ends is one.
pub(crate) fn collision_shapes(
    link: &urdf_rs::Link,
    target_from_link: &RigidTransform,
    cylinders: Cylinders,
) -> Result<Vec<Shape>, CollisionError> {
    let collisions = link.collision.iter().enumerate();
    let mut primitives = collisions
        .map(|(index, collision)| primitive(link, index + 1, collision, target_from_link))
        .collect::<Result<Vec<_>, _>>()?;
    let mut shapes = Vec::new();
    while let Some(index) = primitives
        .iter()
        .position(|one| matches!(one, Primitive::Cylinder { .. }))
    {
        let Primitive::Cylinder { frame, radius, length } = primitives.remove(index) else {
            break;
        };
        let ends = [-0.5, 0.5].map(|share| frame.transform_point(&Point3::new(0.0, 0.0, share * length)));
        let is_capsule = take_caps(&mut primitives, &ends, radius);
        shapes.push(if is_capsule || cylinders == Cylinders::Rounded {
            Shape::capsule(&ends[0], &ends[1], radius)?
        } else {
            Shape::cylinder(&frame, radius, length)?
        });
    }
    for primitive in primitives {
        shapes.push(match primitive {
            Primitive::Sphere { centre, radius } => Shape::sphere(&centre, radius)?,
            Primitive::Shape(shape) => shape,
            Primitive::Cylinder { .. } => continue,
        });
    }
    Ok(shapes)
}

/// Removes the spheres at both ends of a cylinder, if they are there.
fn take_caps(primitives: &mut Vec<Primitive>, ends: &[Point3<f64>; 2], of_radius: f64) -> bool {
    let cap = |end: &Point3<f64>| {
        primitives.iter().position(|primitive| {
            matches!(primitive, Primitive::Sphere { centre, radius }
                if (centre - end).norm() < SAME && (radius - of_radius).abs() < SAME)
        })
    };
    let (Some(first), Some(second)) = (cap(&ends[0]), cap(&ends[1])) else {
        return false;
    };
    if first == second {
        return false;
    }
    primitives.remove(first.max(second));
    primitives.remove(first.min(second));
    true
}

fn primitive(
    link: &urdf_rs::Link,
    number: usize,
    collision: &urdf_rs::Collision,
    target_from_link: &RigidTransform,
) -> Result<Primitive, CollisionError> {
    let place = || format!("link `{}`, collision shape {number}", link.name);
    let frame = *target_from_link * transform(&place(), &collision.origin)?;
    let with_place = |error: CollisionError| match error {
        CollisionError::Number {
            what, value, allowed, ..
        } => CollisionError::Number {
            place: place(),
            what,
            value,
            allowed,
        },
        other => other,
    };
    let primitive = match &collision.geometry {
        Geometry::Box { size } => Shape::cuboid(&frame, size.0).map(Primitive::Shape),
        &Geometry::Cylinder { radius, length } => {
            // Made here only to refuse what is none; whether it is part of a capsule shows later.
            Shape::cylinder(&frame, radius, length).map(|_| Primitive::Cylinder { frame, radius, length })
        }
        &Geometry::Capsule { radius, length } => {
            let [from, to] = [-0.5, 0.5].map(|share| frame.transform_point(&Point3::new(0.0, 0.0, share * length)));
            Shape::capsule(&from, &to, radius).map(Primitive::Shape)
        }
        &Geometry::Sphere { radius } => {
            let centre = Point3::from(frame.translation());
            Shape::sphere(&centre, radius).map(|_| Primitive::Sphere { centre, radius })
        }
        Geometry::Mesh { filename, .. } => Err(CollisionError::ShapeKind {
            link: link.name.clone(),
            shape: number,
            kind: format!("mesh ({filename})"),
        }),
    };
    primitive.map_err(with_place)
}

/// `parent_from_child` of an `origin` element.
pub(crate) fn transform(place: &str, origin: &urdf_rs::Pose) -> Result<RigidTransform, CollisionError> {
    let ([x, y, z], [roll, pitch, yaw]) = (origin.xyz.0, origin.rpy.0);
    require_finite(place, "origin", &[x, y, z, roll, pitch, yaw])?;
    let rotation = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
    Ok(RigidTransform::from_parts(Vector3::new(x, y, z), rotation))
}

/// Where a link hangs.
pub(crate) struct Support<'a> {
    /// The first joint on the way up that moves, or the base or root link if none does.
    pub(crate) carrier: Carrier<'a>,
    pub(crate) carrier_from_link: RigidTransform,
}

pub(crate) enum Carrier<'a> {
    Joint(&'a urdf_rs::Joint),
    Link(&'a str),
}

/// Goes up fixed joints from a link, no farther than to `base`.
pub(crate) fn support<'a>(robot: &'a Robot, base: &str, link: &'a str) -> Result<Support<'a>, CollisionError> {
    let (mut name, mut carrier_from_link) = (link, RigidTransform::identity());
    for _ in 0..MOST_LINKS {
        let above = robot.joints.iter().find(|joint| joint.child.link == name);
        let Some(joint) = above.filter(|_| name != base) else {
            let carrier = Carrier::Link(name);
            return Ok(Support {
                carrier,
                carrier_from_link,
            });
        };
        if joint.joint_type != JointType::Fixed {
            let carrier = Carrier::Joint(joint);
            return Ok(Support {
                carrier,
                carrier_from_link,
            });
        }
        carrier_from_link = transform(&format!("joint `{}`", joint.name), &joint.origin)? * carrier_from_link;
        name = &joint.parent.link;
    }
    Err(CollisionError::Loop { link: link.to_owned() })
}

/// The next link upwards that has collision shapes.
pub(crate) fn solid_parent<'a>(robot: &'a Robot, link: &str) -> Option<&'a str> {
    let mut name = link;
    for _ in 0..MOST_LINKS {
        let joint = robot.joints.iter().find(|joint| joint.child.link == name)?;
        let parent = robot.links.iter().find(|known| known.name == joint.parent.link)?;
        if !parent.collision.is_empty() {
            return Some(&parent.name);
        }
        name = &parent.name;
    }
    None
}
