//! Running other programs.

use std::ffi::OsStr;
use std::io::{BufRead, BufReader, IsTerminal, Read, Write};
use std::path::PathBuf;
use std::process::{Command, ExitCode, ExitStatus, Stdio};
use std::thread;

use anyhow::{Context, Result, bail};

/// The cargo that runs us, so that one `+toolchain` choice holds for everything below.
pub(crate) fn cargo() -> Command {
    Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
}

/// First executable of that name on the `PATH`.
pub(crate) fn find_program(name: &str) -> Option<PathBuf> {
    find_programs(name).into_iter().next()
}

/// Every executable of that name on the `PATH`, in its order.
pub(crate) fn find_programs(name: &str) -> Vec<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path)
        .map(|folder| folder.join(name))
        .filter(|file| is_executable(file))
        .collect()
}

fn is_executable(file: &std::path::Path) -> bool {
    use std::os::unix::fs::PermissionsExt;
    file.metadata()
        .is_ok_and(|data| data.is_file() && data.permissions().mode() & 0o111 != 0)
}

/// Runs a command whose output the user sees on standard error; a failure names the command.
pub(crate) fn run(command: &mut Command) -> Result<()> {
    let status = status(command.stdin(Stdio::null()).stdout(std::io::stderr()))?;
    if !status.success() {
        bail!("`{}` ended with {status}", describe(command));
    }
    Ok(())
}

/// Runs a command that inherits our streams, as it is set up.
pub(crate) fn status(command: &mut Command) -> Result<ExitStatus> {
    command
        .status()
        .with_context(|| format!("cannot start `{}`", describe(command)))
}

/// Ours, after a child that we stand for: its own code, or failure if a signal ended it.
pub(crate) fn exit_code(status: ExitStatus) -> ExitCode {
    let code = status.code().and_then(|code| u8::try_from(code).ok());
    code.map_or(ExitCode::FAILURE, ExitCode::from)
}

/// Standard output of a command that must succeed; a failure shows what it printed.
pub(crate) fn capture(command: &mut Command) -> Result<String> {
    let output = command
        .stdin(Stdio::null())
        .output()
        .with_context(|| format!("cannot start `{}`", describe(command)))?;
    if !output.status.success() {
        let said = [&output.stdout[..], &output.stderr].concat();
        let said = String::from_utf8_lossy(&said).trim().to_owned();
        bail!("`{}` ended with {}:\n{said}", describe(command), output.status);
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// What a watched command printed (both streams, without colours) and how it ended.
pub(crate) struct Watched {
    pub(crate) status: ExitStatus,
    pub(crate) output: String,
}

/// Runs a command and shows its output line by line while keeping a copy to read figures from.
pub(crate) fn watch(command: &mut Command) -> Result<Watched> {
    if std::io::stdout().is_terminal() {
        command.env("CARGO_TERM_COLOR", "always").env("PY_COLORS", "1");
    }
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .with_context(|| format!("cannot start `{}`", describe(command)))?;
    let errors = child.stderr.take().context("the child has no standard error")?;
    let printed = child.stdout.take().context("the child has no standard output")?;
    let errors = thread::spawn(move || relay(errors, std::io::stderr()));
    let mut output = relay(printed, std::io::stdout());
    output.push_str(&errors.join().expect("relaying lines does not panic"));
    Ok(Watched {
        status: child.wait()?,
        output: without_colours(&output),
    })
}

fn relay(from: impl Read, mut to: impl Write) -> String {
    let mut copy = String::new();
    let mut reader = BufReader::new(from);
    let mut line = Vec::new();
    while reader.read_until(b'\n', &mut line).is_ok_and(|count| count > 0) {
        // A closed terminal must not stop the child by blocking its pipe: keep reading, whatever becomes of the copy.
        let _ = to.write_all(&line).and_then(|()| to.flush());
        copy.push_str(&String::from_utf8_lossy(&line));
        line.clear();
    }
    copy
}

/// Text without ANSI colour sequences (`ESC [ ... letter`).
fn without_colours(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut characters = text.chars();
    while let Some(character) = characters.next() {
        if character == '\u{1b}' {
            characters.by_ref().skip(1).find(char::is_ascii_alphabetic);
        } else {
            plain.push(character);
        }
    }
    plain
}

/// A command as one would type it: cargo without the folder that rustup keeps it in.
pub(crate) fn describe(command: &Command) -> String {
    let program = if command.get_program() == cargo().get_program() {
        "cargo".as_ref()
    } else {
        command.get_program()
    };
    let words = std::iter::once(program).chain(command.get_args());
    words.map(OsStr::to_string_lossy).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_removed_and_text_is_kept() {
        assert_eq!(
            without_colours("\u{1b}[32;1m     Summary\u{1b}[0m [   1.2s] 3 tests"),
            "     Summary [   1.2s] 3 tests"
        );
    }

    #[test]
    fn watching_keeps_both_streams_and_the_exit_code() {
        let watched = watch(Command::new("sh").args(["-c", "echo out; echo err >&2; exit 3"])).unwrap();
        assert_eq!(watched.status.code(), Some(3));
        assert!(
            watched.output.contains("out\n") && watched.output.contains("err\n"),
            "{}",
            watched.output
        );
    }

    #[test]
    fn a_failed_capture_shows_the_command_and_what_it_said() {
        let error = capture(Command::new("sh").args(["-c", "echo reason >&2; exit 2"]))
            .unwrap_err()
            .to_string();
        assert!(error.contains("exit 2") && error.contains("reason"), "{error}");
    }

    #[test]
    fn programs_are_found_on_the_path_only_if_executable() {
        assert!(find_program("sh").is_some());
        assert!(find_program("surely-not-a-program-of-this-name").is_none());
    }
}
