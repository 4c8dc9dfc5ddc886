//! Which parameters `list_parameters` names.

use std::collections::BTreeSet;

use interfaces::rcl_interfaces::msg::ListParametersResult;
use interfaces::rcl_interfaces::srv::ListParametersRequest;

const SEPARATOR: char = '.';

/// Names below one of `prefixes` (all, when there is none) with at most `depth` parts below it (0 = any number), and
/// the groups they are in.
pub(crate) fn list<'a>(names: impl Iterator<Item = &'a str>, request: &ListParametersRequest) -> ListParametersResult {
    let wanted = |name: &str| {
        if request.prefixes.is_empty() {
            return within_depth(name, request.depth);
        }
        request
            .prefixes
            .iter()
            .any(|prefix| name == prefix || below(name, prefix).is_some_and(|rest| within_depth(rest, request.depth)))
    };
    let names: Vec<String> = names.filter(|name| wanted(name)).map(str::to_owned).collect();
    let groups: BTreeSet<&str> = names
        .iter()
        .filter_map(|name| name.rsplit_once(SEPARATOR))
        .map(|(group, _)| group)
        .collect();
    let prefixes = groups.into_iter().map(str::to_owned).collect();
    ListParametersResult { names, prefixes }
}

fn below<'a>(name: &'a str, prefix: &str) -> Option<&'a str> {
    name.strip_prefix(prefix)?.strip_prefix(SEPARATOR)
}

fn within_depth(name: &str, depth: u64) -> bool {
    depth == ListParametersRequest::DEPTH_RECURSIVE || (name.split(SEPARATOR).count() as u64) <= depth
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: [&str; 5] = ["gain", "lights.c1.gain", "lights.c2.gain", "lights.count", "lightsome"];

    fn listed(prefixes: &[&str], depth: u64) -> (Vec<String>, Vec<String>) {
        let prefixes = prefixes.iter().map(|&prefix| prefix.to_owned()).collect();
        let result = list(NAMES.into_iter(), &ListParametersRequest { prefixes, depth });
        (result.names, result.prefixes)
    }

    #[test]
    fn without_prefix_and_depth_everything_is_listed() {
        let (names, prefixes) = listed(&[], 0);
        assert_eq!(names, NAMES);
        assert_eq!(prefixes, ["lights", "lights.c1", "lights.c2"]);
    }

    #[test]
    fn depth_counts_parts_below_the_prefix() {
        assert_eq!(listed(&[], 1).0, ["gain", "lightsome"]);
        assert_eq!(listed(&[], 2).0, ["gain", "lights.count", "lightsome"]);
        assert_eq!(listed(&["lights"], 1).0, ["lights.count"]);
        assert_eq!(
            listed(&["lights"], 2).0,
            ["lights.c1.gain", "lights.c2.gain", "lights.count"]
        );
    }

    #[test]
    fn prefixes_match_whole_parts_and_full_names() {
        assert_eq!(
            listed(&["lights.c1"], 0),
            (vec!["lights.c1.gain".into()], vec!["lights.c1".into()])
        );
        assert_eq!(listed(&["gain"], 1).0, ["gain"]);
        assert_eq!(listed(&["lig"], 0), (vec![], vec![]));
    }
}
