//! Child processes that end with their test.

use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Instant;

use crate::domain::Domain;
use crate::waiting::{POLL, TIMEOUT};

type Lines = Arc<Mutex<Vec<String>>>;

/// A program under test. It is killed when this is dropped, and what it said is shown when the test fails.
///
/// Its standard input is a pipe that closes when the test's process dies in whatever way; programs of this workspace
/// that get `--end-with-stdin` end then, too.
pub struct Program {
    name: String,
    child: Child,
    stdout: Lines,
    stderr: Lines,
    /// Lines of `stdout` that [`Self::wait_for_line`] has passed.
    read: usize,
}

impl Program {
    /// Starts `path` in a domain.
    ///
    /// # Panics
    ///
    /// When it cannot be started.
    pub fn start(domain: &Domain, path: impl AsRef<Path>, arguments: &[&str]) -> Self {
        let path = path.as_ref();
        let mut child = Command::new(path)
            .args(arguments)
            .envs(domain.environment())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap_or_else(|error| panic!("cannot start {}: {error}", path.display()));
        Self {
            name: path
                .file_name()
                .map_or_else(String::new, |name| name.to_string_lossy().into_owned()),
            stdout: collect(child.stdout.take()),
            stderr: collect(child.stderr.take()),
            child,
            read: 0,
        }
    }

    /// Waits for a line on its standard output that begins with `start`, and gives that line. Lines before it count as
    /// read.
    ///
    /// # Panics
    ///
    /// When there is none in time, or the program ends without one.
    pub fn wait_for_line(&mut self, start: &str) -> String {
        let deadline = Instant::now() + TIMEOUT;
        loop {
            let ended = self.has_ended();
            let lines = lock(&self.stdout);
            if let Some(at) = (self.read..lines.len()).find(|at| lines[*at].starts_with(start)) {
                self.read = at + 1;
                return lines[at].clone();
            }
            drop(lines);
            assert!(ended.is_none(), "{} ended ({ended:?}) without {start:?}", self.name);
            assert!(
                Instant::now() < deadline,
                "waited {TIMEOUT:?} for {start:?} of {}",
                self.name
            );
            thread::sleep(POLL);
        }
    }

    /// How many lines of its standard output begin with `start` so far.
    pub fn count_lines(&self, start: &str) -> usize {
        lock(&self.stdout).iter().filter(|line| line.starts_with(start)).count()
    }

    /// All that it said on standard error so far.
    pub fn stderr(&self) -> String {
        lock(&self.stderr).join("\n")
    }

    /// Its exit status, if it has ended.
    ///
    /// # Panics
    ///
    /// When the system does not tell.
    pub fn has_ended(&mut self) -> Option<ExitStatus> {
        self.child.try_wait().expect("a child's state can be asked for")
    }

    /// Its process id.
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Waits until it ends by itself, or because of what was done to it.
    ///
    /// # Panics
    ///
    /// When it does not in time.
    pub fn wait(&mut self) -> ExitStatus {
        let deadline = Instant::now() + TIMEOUT;
        loop {
            if let Some(status) = self.has_ended() {
                return status;
            }
            assert!(Instant::now() < deadline, "{} does not end", self.name);
            thread::sleep(POLL);
        }
    }

    /// Ends it as `kill -9` does: no word to anybody.
    ///
    /// # Panics
    ///
    /// When it cannot be killed.
    pub fn kill(&mut self) {
        self.child.kill().expect("a child can be killed");
        self.child.wait().expect("a killed child ends");
    }

    /// Closes its standard input, upon which `--end-with-stdin` programs end in good order.
    ///
    /// # Panics
    ///
    /// When it does not end in time.
    pub fn finish(&mut self) -> ExitStatus {
        drop(self.child.stdin.take());
        self.wait()
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        if thread::panicking() {
            let (out, err) = (lock(&self.stdout).join("\n"), self.stderr());
            eprintln!("---- stdout of {}\n{out}\n---- stderr of {0}\n{err}", self.name);
        }
    }
}

fn lock(lines: &Lines) -> std::sync::MutexGuard<'_, Vec<String>> {
    lines.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Takes all lines as they come, so that a full pipe never blocks the child.
fn collect(pipe: Option<impl Read + Send + 'static>) -> Lines {
    let lines = Lines::default();
    let taken = Arc::clone(&lines);
    let pipe = pipe.expect("the child has a pipe");
    thread::spawn(move || {
        for line in BufReader::new(pipe).lines() {
            let Ok(line) = line else { return };
            lock(&taken).push(line);
        }
    });
    lines
}
