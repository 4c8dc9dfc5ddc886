//! How many tests ran, read from the closing lines of the test runners.

use std::ops::AddAssign;

/// Outcome counts of one runner or of several together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Counts {
    pub(super) passed: usize,
    pub(super) failed: usize,
    pub(super) skipped: usize,
}

impl AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        self.passed += other.passed;
        self.failed += other.failed;
        self.skipped += other.skipped;
    }
}

impl Counts {
    /// `     Summary [   1.203s] 13 tests run: 12 passed (1 flaky), 1 failed, 2 skipped`
    pub(super) fn of_nextest(output: &str) -> Self {
        let mut counts = Self::default();
        for line in output.lines().filter(|line| line.trim_start().starts_with("Summary [")) {
            if let Some((_, outcomes)) = line.split_once(':') {
                counts += Self::of_outcomes(outcomes);
            }
        }
        counts
    }

    /// `test result: ok. 5 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out; finished in 0.10s`, once a binary
    pub(super) fn of_libtest(output: &str) -> Self {
        let mut counts = Self::default();
        for line in output.lines().filter(|line| line.starts_with("test result:")) {
            counts += Self::of_outcomes(line.split_once(". ").map_or("", |(_, outcomes)| outcomes));
        }
        counts
    }

    /// `==== 1 failed, 3 passed, 1 skipped in 0.52s ====`, or the same without the rule when pytest is quiet
    pub(super) fn of_pytest(output: &str) -> Self {
        let closing = output
            .lines()
            .rev()
            .map(|line| line.trim_matches(['=', ' ']))
            .find(|line| line.contains(" in "));
        closing
            .and_then(|line| line.split_once(" in "))
            .map_or_else(Self::default, |(outcomes, _)| Self::of_outcomes(outcomes))
    }

    /// `3 passed, 1 failed` in any order and with either separator.
    fn of_outcomes(text: &str) -> Self {
        let mut counts = Self::default();
        for outcome in text.split([',', ';']) {
            let mut words = outcome.split_whitespace();
            let (Some(Ok(number)), Some(word)) = (words.next().map(str::parse::<usize>), words.next()) else {
                continue;
            };
            match word {
                "passed" => counts.passed += number,
                "failed" | "errors" | "error" | "exec" | "timed" => counts.failed += number,
                "skipped" | "ignored" => counts.skipped += number,
                _ => {}
            }
        }
        counts
    }

    pub(super) fn ran(self) -> usize {
        self.passed + self.failed
    }
}

impl std::fmt::Display for Counts {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{} passed, {} failed", self.passed, self.failed)?;
        if self.skipped > 0 {
            write!(formatter, ", {} skipped", self.skipped)
        } else {
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counts(passed: usize, failed: usize, skipped: usize) -> Counts {
        Counts {
            passed,
            failed,
            skipped,
        }
    }

    #[test]
    fn nextest_counts_failures_of_every_kind() {
        let output = "        PASS [   0.1s] a b\n     Summary [   1.203s] 15 tests run: 12 passed (1 flaky), 1 failed, \
                      1 exec failed, 1 timed out, 2 skipped\n        FAIL c";
        assert_eq!(Counts::of_nextest(output), counts(12, 3, 2));
        assert_eq!(
            Counts::of_nextest("     Summary [ 0.1s] 1 test run: 1 passed, 0 skipped"),
            counts(1, 0, 0)
        );
    }

    #[test]
    fn libtest_counts_add_up_over_binaries() {
        let output = "test result: ok. 5 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out; finished in 0.10s\n\
                      test result: FAILED. 1 passed; 2 failed; 0 ignored; 0 measured; 0 filtered out";
        assert_eq!(Counts::of_libtest(output), counts(6, 2, 1));
    }

    #[test]
    fn pytest_counts_come_from_the_last_line() {
        let output =
            "test_a.py ...\n=== 9 passed in 0.1s ===\n===== 1 failed, 3 passed, 1 skipped, 2 errors in 0.52s =====\n";
        assert_eq!(Counts::of_pytest(output), counts(3, 3, 1));
        assert_eq!(Counts::of_pytest("3 passed in 62.51s (0:01:02)"), counts(3, 0, 0));
        assert_eq!(Counts::of_pytest("no tests ran in 0.01s"), counts(0, 0, 0));
    }

    #[test]
    fn output_without_a_closing_line_counts_nothing() {
        for count in [Counts::of_nextest, Counts::of_libtest, Counts::of_pytest] {
            assert_eq!(count("error: could not compile"), counts(0, 0, 0));
        }
    }

    #[test]
    fn totals_read_as_runners_print_them() {
        assert_eq!(counts(3, 0, 0).to_string(), "3 passed, 0 failed");
        assert_eq!(counts(3, 1, 2).to_string(), "3 passed, 1 failed, 2 skipped");
    }
}
