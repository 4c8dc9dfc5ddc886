//! The tree of frames and the way through it.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use geometry::RigidTransform;

use super::error::TfError;
use super::history::History;
use super::message::StampedTransform;

/// Every frame that hangs on another one, by name.
#[derive(Debug, Default)]
pub(super) struct Tree {
    frames: BTreeMap<String, Frame>,
}

#[derive(Debug)]
struct Frame {
    parent: String,
    history: History,
}

/// The frames between two frames and the frame that both hang on.
struct Way<'a> {
    from_source: Vec<(&'a str, &'a Frame)>,
    from_target: Vec<(&'a str, &'a Frame)>,
}

impl Tree {
    pub(super) fn insert(
        &mut self,
        transform: &StampedTransform,
        is_static: bool,
        kept: Duration,
    ) -> Result<(), TfError> {
        let StampedTransform {
            parent,
            child,
            stamp,
            parent_from_child,
        } = transform;
        if parent.is_empty() || child.is_empty() {
            return Err(TfError::Unnamed {
                child: child.clone(),
                parent: parent.clone(),
            });
        }
        if let Some(frame) = self.frames.get_mut(child) {
            return frame.insert(transform, is_static, kept);
        }
        self.refuse_circle(child, parent)?;
        let parent = parent.clone();
        let history = if is_static {
            History::Static(*parent_from_child)
        } else {
            History::Moving(BTreeMap::from([(*stamp, *parent_from_child)]))
        };
        self.frames.insert(child.clone(), Frame { parent, history });
        Ok(())
    }

    fn refuse_circle(&self, child: &str, parent: &str) -> Result<(), TfError> {
        let mut circle = vec![child.to_owned(), parent.to_owned()];
        circle.extend(self.chain(parent).map(|(_, frame)| frame.parent.clone()));
        match circle[1..].iter().position(|frame| frame == child) {
            None => Ok(()),
            Some(end) => {
                circle.truncate(end + 2);
                Err(TfError::Cycle {
                    child: child.into(),
                    parent: parent.into(),
                    circle,
                })
            }
        }
    }

    /// `target_from_source` at a time.
    pub(super) fn lookup(&self, target: &str, source: &str, time: i64) -> Result<RigidTransform, TfError> {
        let way = self.way(target, source)?;
        let common_from_source = compose(&way.from_source, time)?;
        let common_from_target = compose(&way.from_target, time)?;
        Ok(common_from_target.inverse() * common_from_source)
    }

    /// The newest time at which every frame on the way is known; `None` when none of them moves.
    pub(super) fn latest_common_time(&self, target: &str, source: &str) -> Result<Option<i64>, TfError> {
        let way = self.way(target, source)?;
        let spans = || {
            let frames = way.from_source.iter().chain(&way.from_target);
            frames.filter_map(|(name, frame)| frame.history.span().map(|span| (*name, span)))
        };
        let first_to_end = spans().min_by_key(|(_, span)| span.newest);
        let last_to_begin = spans().max_by_key(|(_, span)| span.oldest);
        match (first_to_end, last_to_begin) {
            (Some((early, ends)), Some((late, begins))) if ends.newest < begins.oldest => Err(TfError::NoCommonTime {
                late: late.into(),
                from: begins.oldest,
                early: early.into(),
                until: ends.newest,
            }),
            (first_to_end, _) => Ok(first_to_end.map(|(_, span)| span.newest)),
        }
    }

    /// Every frame, also those that hang on nothing.
    pub(super) fn names(&self) -> BTreeSet<&str> {
        self.frames
            .iter()
            .flat_map(|(child, frame)| [child.as_str(), frame.parent.as_str()])
            .collect()
    }

    /// Forgets what moved; what is static stays.
    pub(super) fn forget_moving(&mut self) {
        self.frames
            .retain(|_, frame| matches!(frame.history, History::Static(_)));
    }

    fn way(&self, target: &str, source: &str) -> Result<Way<'_>, TfError> {
        self.require(target)?;
        self.require(source)?;
        let mut way = Way {
            from_source: self.chain(source).collect(),
            from_target: self.chain(target).collect(),
        };
        let (source_root, target_root) = (root(&way.from_source, source), root(&way.from_target, target));
        if source_root != target_root {
            return Err(TfError::NotConnected {
                target: target.into(),
                source_frame: source.into(),
                target_root: target_root.into(),
                source_root: source_root.into(),
            });
        }
        // Seen from the root, both chains begin alike up to the frame where they part.
        let shared = way
            .from_source
            .iter()
            .rev()
            .zip(way.from_target.iter().rev())
            .take_while(|((a, _), (b, _))| a == b);
        let shared = shared.count();
        way.from_source.truncate(way.from_source.len() - shared);
        way.from_target.truncate(way.from_target.len() - shared);
        Ok(way)
    }

    fn require(&self, frame: &str) -> Result<(), TfError> {
        let names = self.names();
        if names.contains(frame) {
            return Ok(());
        }
        Err(TfError::UnknownFrame {
            frame: frame.into(),
            known: names.into_iter().map(str::to_owned).collect(),
        })
    }

    /// A frame and what it hangs on, up to the root, which is not part of it. Insertion keeps it free of circles.
    fn chain<'a>(&'a self, frame: &str) -> impl Iterator<Item = (&'a str, &'a Frame)> {
        let first = self.frames.get_key_value(frame);
        std::iter::successors(first, |(_, frame)| self.frames.get_key_value(&frame.parent))
            .map(|(name, frame)| (name.as_str(), frame))
    }
}

impl Frame {
    fn insert(&mut self, transform: &StampedTransform, is_static: bool, kept: Duration) -> Result<(), TfError> {
        let child = transform.child.clone();
        if self.parent != transform.parent {
            return Err(TfError::SecondParent {
                child,
                known: self.parent.clone(),
                found: transform.parent.clone(),
            });
        }
        if matches!(self.history, History::Static(_)) != is_static {
            return Err(TfError::StaticAndMoving { child });
        }
        let stamp = transform.stamp;
        self.history
            .insert(stamp, transform.parent_from_child, kept)
            .map_err(|newest| TfError::TooOld {
                child,
                stamp,
                newest,
                kept,
            })
    }
}

fn root<'a>(chain: &[(&'a str, &'a Frame)], frame: &'a str) -> &'a str {
    chain.last().map_or(frame, |(_, last)| last.parent.as_str())
}

/// `ancestor_from_frame` along a chain.
fn compose(chain: &[(&str, &Frame)], time: i64) -> Result<RigidTransform, TfError> {
    chain
        .iter()
        .try_fold(RigidTransform::identity(), |parent_from_frame, (name, frame)| {
            let grandparent_from_parent = frame.history.at(time).map_err(|span| TfError::Extrapolation {
                child: (*name).to_owned(),
                parent: frame.parent.clone(),
                requested: time,
                oldest: span.oldest,
                newest: span.newest,
            })?;
            Ok(grandparent_from_parent * parent_from_frame)
        })
}
