//! Writes the error tables of this crate's `README.md` anew, from the protocol's own.

use std::path::Path;
use std::{fs, io};

use xarm_protocol::{controller_errors, markdown_table, servo_errors, warnings};

const BEGIN: &str = "<!-- error tables: begin (cargo run -p xarm_tcp --example error_table) -->";
const END: &str = "<!-- error tables: end -->";

fn main() -> io::Result<()> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md");
    let readme = fs::read_to_string(&path)?;
    let updated = updated(&readme).ok_or_else(|| io::Error::other("README.md has not both marker comments"))?;
    fs::write(path, updated)
}

/// The page with new tables; none where their markers are missing.
fn updated(readme: &str) -> Option<String> {
    let (before, rest) = readme.split_once(BEGIN)?;
    let (_, after) = rest.split_once(END)?;
    let tables = [
        ("Errors of the controller", controller_errors()),
        (
            "Errors of the servos (behind the controller's errors 10 to 17)",
            servo_errors(),
        ),
        ("Warnings", warnings()),
    ];
    let tables = tables.map(|(title, faults)| format!("### {title}\n\n{}\n", markdown_table(faults)));
    Some(format!("{before}{BEGIN}\n\n{}{END}{after}", tables.concat()))
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_readme_has_the_tables_of_the_protocol() {
        let readme = include_str!("../README.md");
        assert!(
            super::updated(readme).as_deref() == Some(readme),
            "the tables differ; write them anew with: cargo run -p xarm_tcp --example error_table"
        );
    }
}
