//! Who may install system packages, and how.

use std::io::IsTerminal;
use std::os::unix::fs::MetadataExt;
use std::process::Command;

use super::succeeds;
use crate::process::find_program;

/// The way to run one command as root.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Privilege {
    Root,
    /// sudo asks for no password
    SudoSilent,
    /// sudo asks at the terminal
    SudoInteractive,
}

impl Privilege {
    pub(super) fn detect() -> Option<Self> {
        let has_sudo = find_program("sudo").is_some();
        Self::choose(
            is_root(),
            has_sudo && succeeds(Command::new("sudo").args(["-n", "true"])),
            has_sudo && std::io::stdin().is_terminal(),
        )
    }

    fn choose(root: bool, sudo_without_password: bool, sudo_at_terminal: bool) -> Option<Self> {
        match (root, sudo_without_password, sudo_at_terminal) {
            (true, _, _) => Some(Self::Root),
            (_, true, _) => Some(Self::SudoSilent),
            (_, _, true) => Some(Self::SudoInteractive),
            _ => None,
        }
    }

    /// `words` as root, with apt's questions turned off (through `env`, because sudo drops our environment).
    pub(super) fn command(self, words: &[&str]) -> Command {
        let prefix: &[&str] = match self {
            Self::Root => &["env"],
            Self::SudoSilent => &["sudo", "-n", "env"],
            Self::SudoInteractive => &["sudo", "env"],
        };
        let mut command = Command::new(prefix[0]);
        command
            .args(&prefix[1..])
            .arg("DEBIAN_FRONTEND=noninteractive")
            .args(words);
        command
    }
}

fn is_root() -> bool {
    std::fs::metadata("/proc/self").is_ok_and(|process| process.uid() == 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_intrusive_way_is_chosen() {
        assert_eq!(Privilege::choose(true, true, true), Some(Privilege::Root));
        assert_eq!(Privilege::choose(false, true, true), Some(Privilege::SudoSilent));
        assert_eq!(Privilege::choose(false, false, true), Some(Privilege::SudoInteractive));
        assert_eq!(Privilege::choose(false, false, false), None);
    }

    #[test]
    fn root_needs_no_sudo_and_apt_never_asks() {
        let command = crate::process::describe(&Privilege::Root.command(&["apt-get", "update"]));
        assert_eq!(command, "env DEBIAN_FRONTEND=noninteractive apt-get update");
        let command = crate::process::describe(&Privilege::SudoSilent.command(&["apt-get", "update"]));
        assert_eq!(command, "sudo -n env DEBIAN_FRONTEND=noninteractive apt-get update");
    }
}
