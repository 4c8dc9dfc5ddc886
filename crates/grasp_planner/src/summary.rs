//! Why a plan has no grasp, in one line for people.

use grasp::{Failure, Plan, Refused};

/// Reasons that are told, the most frequent first.
const REASONS: usize = 4;

/// Failures of one test, with the nearest miss among them.
struct Reason {
    count: usize,
    nearest: Failure,
}

/// What was looked at and which tests it failed; `cameras` names the plan's views.
pub(crate) fn refusals(plan: &Plan, cameras: &[&str]) -> String {
    let is_whole_view = |refused: &&Refused| refused.pixel.is_none() && refused.contact.is_none();
    let (views, candidates): (Vec<&Refused>, Vec<&Refused>) = plan.refused.iter().partition(is_whole_view);
    let mut told: Vec<String> = views.into_iter().map(|refused| of_view(refused, cameras)).collect();
    if !candidates.is_empty() {
        told.push(of_candidates(&candidates));
    }
    if told.is_empty() {
        return "nothing was found to look at".into();
    }
    told.join("; ")
}

fn of_view(refused: &Refused, cameras: &[&str]) -> String {
    let names: Vec<&str> = refused
        .views
        .iter()
        .filter_map(|view| cameras.get(*view).copied())
        .collect();
    let failures: Vec<String> = refused.failures.iter().map(ToString::to_string).collect();
    format!("{}: {}", names.join(" and "), failures.join(", "))
}

fn of_candidates(candidates: &[&Refused]) -> String {
    let mut reasons: Vec<Reason> = Vec::new();
    for failure in candidates.iter().flat_map(|refused| &refused.failures) {
        match reasons.iter_mut().find(|reason| reason.nearest.test == failure.test) {
            Some(reason) => reason.add(failure),
            None => reasons.push(Reason {
                count: 1,
                nearest: *failure,
            }),
        }
    }
    // Stable: of equally frequent ones the first found stays first.
    reasons.sort_by_key(|reason| std::cmp::Reverse(reason.count));
    let told: Vec<String> = reasons.iter().take(REASONS).map(Reason::text).collect();
    let looked_at = match candidates.len() {
        1 => "the only candidate was refused".to_owned(),
        count => format!("all {count} candidates were refused"),
    };
    format!("{looked_at}: {}", told.join("; "))
}

impl Reason {
    fn add(&mut self, failure: &Failure) {
        self.count += 1;
        if miss(failure) < miss(&self.nearest) {
            self.nearest = *failure;
        }
    }

    fn text(&self) -> String {
        match self.count {
            1 => self.nearest.to_string(),
            count => format!("{count} times, at best {}", self.nearest),
        }
    }
}

/// By how much, relative to what is allowed.
fn miss(failure: &Failure) -> f64 {
    (failure.value - failure.allowed).abs() / failure.allowed.abs().max(1e-9)
}

#[cfg(test)]
mod tests {
    use geometry::nalgebra::Point2;
    use grasp::Test;

    use super::*;

    fn refused(views: &[usize], at: Option<f64>, failures: &[(Test, f64, f64)]) -> Refused {
        let failure = |&(test, value, allowed): &(Test, f64, f64)| Failure { test, value, allowed };
        Refused {
            views: views.to_vec(),
            pixel: at.map(|x| Point2::new(x, 0.0)),
            contact: None,
            normal: None,
            failures: failures.iter().map(failure).collect(),
        }
    }

    fn plan(refused: Vec<Refused>) -> Plan {
        Plan {
            grasps: Vec::new(),
            refused,
            views: 2,
        }
    }

    #[test]
    fn the_most_frequent_failure_comes_first_with_its_nearest_miss() {
        let plan = plan(vec![
            refused(&[0], Some(1.0), &[(Test::EdgeShare, 0.09, 0.04)]),
            refused(&[0, 1], Some(2.0), &[(Test::Border, 0.004, 0.0105)]),
            refused(
                &[1],
                Some(3.0),
                &[(Test::Border, 0.009, 0.0105), (Test::Gap, 0.002, 0.0015)],
            ),
        ]);
        assert_eq!(
            refusals(&plan, &["c1", "c2"]),
            "all 3 candidates were refused: 2 times, at best patch ends 9.0 mm from the contact, needed 10.5 mm; \
             edges cover 9.0 % of the footprint, allowed 4.0 %; lip must give 2.00 mm, allowed 1.50 mm"
        );
    }

    #[test]
    fn an_empty_view_is_told_with_its_camera() {
        let empty = |view| refused(&[view], None, &[(Test::ObjectPixels, 0.0, 90.0)]);
        assert_eq!(
            refusals(&plan(vec![empty(0), empty(1)]), &["c1", "c2"]),
            "c1: 0 object pixels, a cup needs 90; c2: 0 object pixels, a cup needs 90"
        );
        assert_eq!(refusals(&plan(Vec::new()), &["c1"]), "nothing was found to look at");
    }
}
