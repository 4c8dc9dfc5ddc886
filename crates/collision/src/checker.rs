//! What touches what, at some joint angles.

use std::fmt;

use crate::allowance::{Allowance, is_contact, margin_of};
use crate::arm::{ArmModel, Frames, Part};
use crate::carried::CarriedObject;
use crate::error::{CollisionError, require};
use crate::scene::{Obstacle, Scene, unknown};

/// An arm, what it carries, what is around it, and how far they shall stay apart. Copies are cheap. Looks allocate nothing
/// but where the library finds how deep boxes, cylinders, hulls and meshes are in each other.
#[derive(Debug, Clone, Copy)]
pub struct Checker<'a, const N: usize> {
    pub(crate) arm: &'a ArmModel<N>,
    scene: &'a Scene,
    carried: Option<&'a CarriedObject>,
    allowances: &'a [Allowance],
    margin: f64,
}

/// Two things and how far they are apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact<'a> {
    /// A link of the arm, or the carried object.
    pub link: &'a str,
    /// What it is near to or touches.
    pub with: Touched<'a>,
    /// Metres; negative is how deep they are in each other, the shortest way out.
    pub distance: f64,
}

/// What a link is near to or touches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Touched<'a> {
    /// Another link of the arm.
    Link(&'a str),
    /// Something in the scene.
    Obstacle(&'a str),
}

/// Two things that may not touch.
#[derive(Clone, Copy)]
pub(crate) struct Pair<'a> {
    pub(crate) part: &'a Part,
    pub(crate) with: With<'a>,
}

#[derive(Clone, Copy)]
pub(crate) enum With<'a> {
    Part(&'a Part),
    Obstacle(&'a Obstacle),
}

impl<'a, const N: usize> Checker<'a, N> {
    /// Nothing carried, no margin.
    pub fn new(arm: &'a ArmModel<N>, scene: &'a Scene) -> Self {
        Self {
            arm,
            scene,
            carried: None,
            allowances: &[],
            margin: 0.0,
        }
    }

    /// With an object in the tool.
    #[must_use]
    pub fn carrying(self, object: &'a CarriedObject) -> Self {
        Self {
            carried: Some(object),
            ..self
        }
    }

    /// What is nearer than this (metres, 0 to 1) counts as touching.
    pub fn with_margin(self, margin: f64) -> Result<Self, CollisionError> {
        let is_allowed = (0.0..=1.0).contains(&margin);
        require("checker", "margin", margin, is_allowed, "0 to 1 m")?;
        Ok(Self { margin, ..self })
    }

    /// Some may come nearer than the margin.
    ///
    /// # Errors
    /// A margin outside its range; a name of no link and no carried object, or of no obstacle.
    pub fn allowing(self, allowances: &'a [Allowance]) -> Result<Self, CollisionError> {
        for allowance in allowances {
            allowance.check()?;
            self.part(&allowance.link)?;
            if let Some(name) = &allowance.obstacle {
                self.obstacle(name)?;
            }
        }
        Ok(Self { allowances, ..self })
    }

    /// The arm.
    pub fn arm(&self) -> &'a ArmModel<N> {
        self.arm
    }

    /// The nearest or deepest of all contacts at joint angles (radians), each against what it is allowed; none if the arm
    /// is free. Of things deep in each
    /// other it may name a neighbouring pair that is less deep.
    pub fn check(&self, angles: &[f64; N]) -> Result<Option<Contact<'a>>, CollisionError> {
        let frames = self.arm.frames(angles)?;
        let (mut worst, mut least) = (None, 0.0);
        for pair in self.pairs() {
            let margin = self.margin_of(&pair);
            let distance = pair.distance(&frames, margin + least);
            if is_contact(distance, margin + least) {
                least = (distance - margin).min(least);
                worst = Some(pair.contact(distance));
            }
        }
        Ok(worst)
    }

    /// How far a link or the carried object is from an obstacle at joint angles (radians): metres, negative if they are in
    /// each other, `bound` if it is not below that.
    ///
    /// # Errors
    /// Angles that are no numbers; a name that nothing has.
    pub fn distance(&self, angles: &[f64; N], link: &str, obstacle: &str, bound: f64) -> Result<f64, CollisionError> {
        let (part, obstacle) = (self.part(link)?, self.obstacle(obstacle)?);
        Ok(obstacle.distance(part, &self.arm.frames(angles)?, bound))
    }

    /// The two things nearest to each other at joint angles (radians), and how far they are apart; none if all are `bound`
    /// (metres, 0 or more) or more apart. The margin has no part in it.
    pub fn clearance(&self, angles: &[f64; N], bound: f64) -> Result<Option<Contact<'a>>, CollisionError> {
        require("clearance", "bound", bound, bound >= 0.0, "0 m or more")?;
        let frames = self.arm.frames(angles)?;
        let mut nearest = None;
        let mut best = bound;
        for pair in self.pairs() {
            let distance = pair.distance(&frames, best);
            if distance < best {
                best = distance;
                nearest = Some(pair.contact(distance));
            }
        }
        Ok(nearest)
    }

    /// What counts as a contact of a pair, metres.
    pub(crate) fn margin_of(&self, pair: &Pair<'a>) -> f64 {
        margin_of(pair, self.margin, self.allowances)
    }

    fn part(&self, name: &str) -> Result<&'a Part, CollisionError> {
        let carried = self.carried.map(|object| &object.part).into_iter();
        let mut parts = carried.chain(&self.arm.links);
        parts
            .find(|part| part.name == name)
            .ok_or_else(|| unknown("link or carried object", name))
    }

    fn obstacle(&self, name: &str) -> Result<&'a Obstacle, CollisionError> {
        let mut obstacles = self.scene.obstacles.iter();
        obstacles
            .find(|obstacle| obstacle.name == name)
            .ok_or_else(|| unknown("obstacle", name))
    }

    /// All that may not touch.
    pub(crate) fn pairs(&self) -> impl Iterator<Item = Pair<'a>> {
        let (arm, scene, carried) = (self.arm, self.scene, self.carried);
        let own = arm.pairs.iter().map(|&[a, b]| (&arm.links[a], &arm.links[b]));
        let with_carried = carried.into_iter().flat_map(move |object| {
            let links = object.against.iter();
            links.map(move |&link| (&object.part, &arm.links[link]))
        });
        let among_parts = own.chain(with_carried).map(|(part, other)| Pair {
            part,
            with: With::Part(other),
        });
        let parts = carried.map(|object| &object.part).into_iter().chain(&arm.links);
        let with_scene = parts.flat_map(move |part| {
            let obstacles = scene.obstacles.iter().filter(|obstacle| !obstacle.excepts(part));
            obstacles.map(move |obstacle| Pair {
                part,
                with: With::Obstacle(obstacle),
            })
        });
        with_scene.chain(among_parts)
    }
}

impl<'a> Pair<'a> {
    /// Signed, or `bound` if it is not below that.
    pub(crate) fn distance<const N: usize>(&self, frames: &Frames<N>, bound: f64) -> f64 {
        match self.with {
            With::Part(other) => self.part.distance(other, frames, bound),
            With::Obstacle(obstacle) => obstacle.distance(self.part, frames, bound),
        }
    }

    pub(crate) fn contact(&self, distance: f64) -> Contact<'a> {
        let with = match self.with {
            With::Part(other) => Touched::Link(&other.name),
            With::Obstacle(obstacle) => Touched::Obstacle(&obstacle.name),
        };
        Contact {
            link: &self.part.name,
            with,
            distance,
        }
    }
}

impl Contact<'_> {
    /// How deep they are in each other, metres; 0 if they are apart.
    pub fn depth(&self) -> f64 {
        (-self.distance).max(0.0)
    }
}

impl Touched<'_> {
    /// The link's or the obstacle's name.
    pub fn name(&self) -> &str {
        match self {
            Self::Link(name) | Self::Obstacle(name) => name,
        }
    }
}

impl fmt::Display for Contact<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = match self.with {
            Touched::Link(_) => "link",
            Touched::Obstacle(_) => "obstacle",
        };
        let (link, with) = (self.link, self.with.name());
        let millimetres = 1e3 * self.distance.abs();
        let how = if self.distance < 0.0 { "deep in" } else { "from" };
        write!(formatter, "`{link}` is {millimetres:.1} mm {how} {kind} `{with}`")
    }
}
