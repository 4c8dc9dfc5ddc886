//! The connection for requests. A task owns its socket; whoever holds a [`Control`] may ask.
//!
//! Requests wait for each other, as the maker's own clients do it, except for those that stop the arm: these are sent at
//! once, and answers find their request by its transaction number.

use std::sync::Arc;
use std::time::Duration;

use tokio::io::AsyncWriteExt;
use tokio::net::TcpStream;
use tokio::sync::{Mutex, mpsc, oneshot};
use tokio_util::task::AbortOnDropHandle;
use xarm_protocol::{Frame, FrameReader, Protocol, Reply, Request, Transactions};

use crate::error::LinkError;

/// More requests are never under way.
const QUEUE: usize = 16;

/// To ask the controller.
#[derive(Debug, Clone)]
pub(crate) struct Control {
    requests: mpsc::Sender<Exchange>,
    turn: Arc<Mutex<()>>,
    address: String,
    protocol: Protocol,
}

/// Ends when the connection is lost; closes it when dropped.
pub(crate) type ControlTask = AbortOnDropHandle<LinkError>;

#[derive(Debug)]
struct Exchange {
    request: Request,
    protocol: Protocol,
    reply: oneshot::Sender<Reply>,
}

impl Control {
    /// Connects; `patience` is for the connection to be made.
    pub(crate) async fn connect(address: String, patience: Duration) -> Result<(Self, ControlTask), LinkError> {
        let socket = connect(&address, patience).await?;
        let (requests, queue) = mpsc::channel(QUEUE);
        let conversation = Conversation {
            address: address.clone(),
            socket,
            transactions: Transactions::default(),
            waiting: Vec::new(),
        };
        let task = AbortOnDropHandle::new(tokio::spawn(conversation.serve(queue)));
        let control = Self {
            requests,
            turn: Arc::default(),
            address,
            protocol: Protocol::Private,
        };
        Ok((control, task))
    }

    /// From now on as a client that promises to keep the connection alive.
    pub(crate) fn keep_alive(self) -> Self {
        Self {
            protocol: Protocol::KeepAlive,
            ..self
        }
    }

    pub(crate) fn address(&self) -> &str {
        &self.address
    }

    /// In turn.
    pub(crate) async fn ask(
        &self,
        what: &'static str,
        request: Request,
        patience: Duration,
    ) -> Result<Reply, LinkError> {
        let _turn = self.turn.lock().await;
        self.ask_now(what, request, patience).await
    }

    /// Before all others.
    pub(crate) async fn ask_now(
        &self,
        what: &'static str,
        request: Request,
        patience: Duration,
    ) -> Result<Reply, LinkError> {
        let (reply, answer) = oneshot::channel();
        let exchange = Exchange {
            request,
            protocol: self.protocol,
            reply,
        };
        let answered = async {
            self.requests.send(exchange).await.ok()?;
            answer.await.ok()
        };
        match tokio::time::timeout(patience, answered).await {
            Ok(Some(reply)) => Ok(reply),
            Ok(None) => Err(self.lost("it was closed".to_owned())),
            Err(_) => Err(LinkError::Silent {
                address: self.address.clone(),
                what,
                waited: patience,
            }),
        }
    }

    fn lost(&self, reason: String) -> LinkError {
        LinkError::Lost {
            address: self.address.clone(),
            reason,
        }
    }
}

/// A connection without delays for small packets.
pub(crate) async fn connect(address: &str, patience: Duration) -> Result<TcpStream, LinkError> {
    let error = |reason: String| LinkError::Connect {
        address: address.to_owned(),
        reason,
    };
    let connected = tokio::time::timeout(patience, TcpStream::connect(address)).await;
    let socket = connected
        .map_err(|_| error(format!("no answer within {patience:?}")))?
        .map_err(|source| error(source.to_string()))?;
    socket.set_nodelay(true).map_err(|source| error(source.to_string()))?;
    Ok(socket)
}

struct Waiting {
    transaction: u16,
    register: u8,
    reply: oneshot::Sender<Reply>,
}

struct Conversation {
    address: String,
    socket: TcpStream,
    transactions: Transactions,
    waiting: Vec<Waiting>,
}

impl Conversation {
    async fn serve(mut self, mut queue: mpsc::Receiver<Exchange>) -> LinkError {
        let mut reader = FrameReader::default();
        loop {
            let step = tokio::select! {
                readable = self.socket.readable() => match readable {
                    Ok(()) => self.receive(&mut reader),
                    Err(error) => Err(self.lost(error.to_string())),
                },
                Some(exchange) = queue.recv() => self.send(exchange).await,
                else => Err(self.lost("the driver was closed".to_owned())),
            };
            if let Err(error) = step {
                return error;
            }
        }
    }

    async fn send(&mut self, exchange: Exchange) -> Result<(), LinkError> {
        let Exchange {
            request,
            protocol,
            reply,
        } = exchange;
        self.waiting.retain(|waiting| !waiting.reply.is_closed());
        let transaction = self.transactions.next_number();
        self.waiting.push(Waiting {
            transaction,
            register: request.register(),
            reply,
        });
        let bytes = request.frame(transaction, protocol).encode();
        let written = self.socket.write_all(&bytes).await;
        written.map_err(|error| self.lost(error.to_string()))
    }

    fn receive(&mut self, reader: &mut FrameReader) -> Result<(), LinkError> {
        let mut buffer = [0; 2048];
        match self.socket.try_read(&mut buffer) {
            Ok(0) => return Err(self.lost("the controller closed it".to_owned())),
            Ok(count) => reader.push(&buffer[..count]),
            Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => return Ok(()),
            Err(error) => return Err(self.lost(error.to_string())),
        }
        loop {
            match reader.next() {
                Ok(Some(frame)) => self.take(&frame),
                Ok(None) => return Ok(()),
                Err(source) => {
                    return Err(LinkError::Protocol {
                        address: self.address.clone(),
                        source,
                    });
                }
            }
        }
    }

    /// What nobody waits for any more is forgotten, and so is what was not asked for.
    fn take(&mut self, frame: &Frame) {
        let Ok(reply) = Reply::of_frame(frame) else { return };
        let of_it = |waiting: &Waiting| waiting.transaction == frame.transaction && waiting.register == reply.register;
        if let Some(place) = self.waiting.iter().position(of_it) {
            // Whoever asked may have gone.
            let _ = self.waiting.swap_remove(place).reply.send(reply);
        }
    }

    fn lost(&self, reason: String) -> LinkError {
        LinkError::Lost {
            address: self.address.clone(),
            reason,
        }
    }
}
