//! The child process and the thread that reads its lines.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{ChildStdin, Command, Stdio};
use std::thread::JoinHandle;
use std::time::Duration;

use parking_lot::Mutex;

use super::line::Listener;
use super::parts::Parts;
use super::{BoardError, Edge};

/// Ends with its standard input, so it ends with this process however that ends.
#[derive(Debug)]
pub(super) struct Child {
    process: std::process::Child,
    orders: Mutex<Option<ChildStdin>>,
    listener: Option<JoinHandle<()>>,
}

impl Child {
    pub(super) fn start<F>(
        parts: &Parts,
        reset_on_open: Option<Duration>,
        listener: Listener<F>,
    ) -> Result<Self, BoardError>
    where
        F: FnMut(Edge) + Send + 'static,
    {
        let failed = |source| BoardError::Start {
            path: parts.program.clone(),
            source,
        };
        let mut process = Command::new(&parts.program)
            .arg(&parts.firmware)
            .args(reset_on_open.map(|silence| silence.as_micros().to_string()))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(failed)?;
        let (orders, lines, errors) = (process.stdin.take(), process.stdout.take(), process.stderr.take());
        let thread = std::thread::Builder::new().name("light board".into());
        let listening = thread.spawn(move || listen(listener, lines, errors));
        Ok(Self {
            process,
            orders: Mutex::new(orders),
            listener: Some(listening.map_err(failed)?),
        })
    }

    pub(super) fn process_id(&self) -> u32 {
        self.process.id()
    }

    pub(super) fn order(&self, order: &str) -> Result<(), BoardError> {
        let mut orders = self.orders.lock();
        let written = orders
            .as_mut()
            .map(|pipe| pipe.write_all(format!("{order}\n").as_bytes()));
        match written {
            Some(Ok(())) => Ok(()),
            Some(Err(error)) => Err(BoardError::Ended {
                reason: error.to_string(),
            }),
            None => Err(BoardError::Silent),
        }
    }
}

fn listen<F: FnMut(Edge)>(mut listener: Listener<F>, lines: Option<impl Read>, errors: Option<impl Read>) {
    for line in lines.into_iter().flat_map(|pipe| BufReader::new(pipe).lines()) {
        match line {
            Ok(line) => listener.take(&line),
            Err(_) => break,
        }
    }
    let mut last_words = String::new();
    // The child says little there, far less than a pipe holds, and it is at its end.
    if let Some(mut errors) = errors {
        let _ = errors.read_to_string(&mut last_words);
    }
    let last_words = last_words.trim();
    listener.end((!last_words.is_empty()).then(|| last_words.to_owned()));
}

impl Drop for Child {
    fn drop(&mut self) {
        self.orders.get_mut().take();
        // It ends with its input; a hung one is ended.
        let _ = self.process.kill();
        let _ = self.process.wait();
        if let Some(listener) = self.listener.take() {
            let _ = listener.join();
        }
    }
}
