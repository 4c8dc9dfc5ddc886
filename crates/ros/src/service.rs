//! Services, in the "enhanced" mapping of DDS-RPC that Fast DDS uses: a request is known by who sent it and its
//! sequence number, and its reply carries both in the inline QoS.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use futures::StreamExt;
use interfaces::{Message, Service};
use parking_lot::Mutex;
use rustdds::no_key::DeserializedCacheChange;
use rustdds::rpc::SampleIdentity;
use rustdds::{GUID, RTPSEntity, SequenceNumber, Timestamp, with_key::WriteOptionsBuilder};
use tokio::sync::oneshot;
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;

use crate::error::Error;
use crate::graph::{Graph, Reader, Writer};
use crate::qos::Qos;
use crate::wire::WireTopic;

/// How long a request waits until its caller's reply reader is matched. Without it, the reply of a caller that has
/// just been discovered would be lost.
const CALLER_MATCH_TIMEOUT: Duration = Duration::from_millis(200);

/// Answers requests for `S`.
pub struct ServiceServer<S: Service> {
    name: String,
    requests: Reader<S::Request>,
    replies: Arc<Writer<S::Response>>,
    stop: CancellationToken,
}

/// One request that waits for its answer. Dropping it unanswered leaves the caller to its time-out.
pub struct ServiceCall<S: Service> {
    request: Arc<S::Request>,
    caller: SampleIdentity,
    service: String,
    replies: Arc<Writer<S::Response>>,
}

impl<S: Service> ServiceServer<S> {
    pub(crate) fn new(
        graph: &Arc<Graph>,
        name: String,
        type_name: &str,
        stop: CancellationToken,
    ) -> Result<Self, Error> {
        let failed = |reason| Error::Create {
            what: "service server",
            name: name.clone(),
            reason,
        };
        let replies = graph
            .writer(&WireTopic::response(&name, type_name), Qos::SERVICE)
            .map_err(failed)?;
        let requests = graph
            .reader(&WireTopic::request(&name, type_name), Qos::SERVICE)
            .map_err(failed)?;
        Ok(Self {
            name,
            requests,
            replies: Arc::new(replies),
            stop,
        })
    }

    /// The next request; `None` once the node is shut down. Cancel safe.
    pub async fn next(&mut self) -> Option<ServiceCall<S>> {
        let stream = self.requests.dds.as_async_stream();
        tokio::pin!(stream);
        loop {
            let arrived = tokio::select! {
                () = self.stop.cancelled() => return None,
                arrived = stream.next() => arrived?,
            };
            match arrived {
                Ok(sample) => {
                    let caller = caller(&sample);
                    return Some(ServiceCall {
                        request: sample.into_value(),
                        caller,
                        service: self.name.clone(),
                        replies: Arc::clone(&self.replies),
                    });
                }
                Err(error) => {
                    self.requests.graph.counters.count_unreadable();
                    tracing::warn!(service = self.name, %error, "a request is not readable; skipped");
                }
            }
        }
    }

    /// Fully qualified name.
    pub fn name(&self) -> &str {
        &self.name
    }
}

/// Fast DDS names its reply reader as the caller and leaves the sequence number to the request's own.
fn caller<M>(sample: &DeserializedCacheChange<M>) -> SampleIdentity {
    let own = SampleIdentity {
        writer_guid: sample.writer_guid,
        sequence_number: sample.sequence_number,
    };
    match sample.related_sample_identity() {
        Some(named) if named.sequence_number == SequenceNumber::UNKNOWN => SampleIdentity {
            sequence_number: sample.sequence_number,
            ..named
        },
        Some(named) => named,
        None => own,
    }
}

impl<S: Service> ServiceCall<S> {
    /// What was asked.
    pub fn request(&self) -> &S::Request {
        &self.request
    }

    /// Answers.
    pub async fn respond(self, response: impl Into<Arc<S::Response>>) -> Result<(), Error> {
        let (graph, reader) = (&self.replies.graph, self.caller.writer_guid);
        if is_reader(reader) {
            let matched = || self.replies.is_matched_with(reader);
            if graph.wait_until(CALLER_MATCH_TIMEOUT, matched).await.is_err() {
                tracing::debug!(
                    service = self.service,
                    "the caller's reply reader is not matched; answering anyway"
                );
            }
        }
        let options = WriteOptionsBuilder::new()
            .source_timestamp(Timestamp::now())
            .related_sample_identity(self.caller)
            .build();
        match self.replies.dds.write_with_options(response.into(), options) {
            Ok(_) => Ok(()),
            Err(e) => Err(Error::Send {
                service: self.service,
                reason: e.to_string(),
            }),
        }
    }
}

/// RTPS entity kinds (9.3.1.2): the low bits of a reader's kind are 4 (no key) or 7 (with key).
fn is_reader(guid: GUID) -> bool {
    matches!(guid.to_bytes()[15] & 0x0f, 0x04 | 0x07)
}

/// Calls `S`. Clones share one dispatcher: any number of calls may be under way, and each gets its own reply.
pub struct ServiceClient<S: Service> {
    inner: Arc<Client<S>>,
}

impl<S: Service> Clone for ServiceClient<S> {
    fn clone(&self) -> Self {
        Self {
            inner: Arc::clone(&self.inner),
        }
    }
}

struct Client<S: Service> {
    name: String,
    node: String,
    requests: Writer<S::Request>,
    reply_reader: GUID,
    pending: Arc<Mutex<Pending<S::Response>>>,
    replies_matched: Arc<Graph>,
    stop: CancellationToken,
}

type Reply<R> = oneshot::Receiver<Arc<R>>;
type Pending<R> = BTreeMap<i64, oneshot::Sender<Arc<R>>>;

impl<S: Service> ServiceClient<S> {
    pub(crate) fn new(
        graph: &Arc<Graph>,
        node: String,
        name: String,
        type_name: &str,
        stop: &CancellationToken,
    ) -> Result<Self, Error> {
        let failed = |reason| Error::Create {
            what: "service client",
            name: name.clone(),
            reason,
        };
        let replies = graph
            .reader(&WireTopic::response(&name, type_name), Qos::SERVICE)
            .map_err(failed)?;
        let requests = graph
            .writer(&WireTopic::request(&name, type_name), Qos::SERVICE)
            .map_err(failed)?;
        let pending = Arc::new(Mutex::new(Pending::new()));
        // The dispatcher ends with the client or with the node, whichever goes first.
        let stop = stop.child_token();
        let own = [replies.dds.guid(), requests.dds.guid()];
        let reply_reader = replies.dds.guid();
        tokio::spawn(dispatch(name.clone(), replies, own, Arc::clone(&pending), stop.clone()));
        let inner = Client {
            name,
            node,
            requests,
            reply_reader,
            pending,
            replies_matched: Arc::clone(graph),
            stop,
        };
        Ok(Self { inner: Arc::new(inner) })
    }

    /// Asks and waits for the answer. `timeout` covers finding the server and the answer.
    pub async fn call(
        &self,
        request: impl Into<Arc<S::Request>>,
        timeout: Duration,
    ) -> Result<Arc<S::Response>, Error> {
        let deadline = Instant::now() + timeout;
        self.wait_for_server(timeout).await?;
        let (sequence_number, reply) = self.inner.send(request.into())?;
        let answer = tokio::select! {
            () = self.inner.stop.cancelled() => Err(Error::ShutDown { node: self.inner.node.clone() }),
            answer = tokio::time::timeout_at(deadline, reply) => answer
                .ok()
                .and_then(Result::ok)
                .ok_or_else(|| Error::TimedOut { what: "service", name: self.inner.name.clone(), waited: timeout }),
        };
        self.inner.pending.lock().remove(&sequence_number);
        answer
    }

    /// Asks without waiting for the answer: returns when the server's side has the request, or after `timeout`. Unlike
    /// [`Self::call`] it works while the node shuts down, for a last word such as "lights off".
    pub async fn tell(&self, request: impl Into<Arc<S::Request>>, timeout: Duration) -> Result<(), Error> {
        let deadline = Instant::now() + timeout;
        // Nobody reads answers any more once the node shuts down.
        let server = self
            .inner
            .replies_matched
            .wait_until(timeout, || self.inner.requests.matched() > 0);
        server.await.map_err(|waited| Error::NotFound {
            what: "server of service",
            name: self.inner.name.clone(),
            waited,
        })?;
        let (sequence_number, _) = self.inner.send(request.into())?;
        self.inner.pending.lock().remove(&sequence_number);
        let acknowledged = self.inner.requests.dds.async_wait_for_acknowledgments();
        match tokio::time::timeout_at(deadline, acknowledged).await {
            Ok(Ok(true)) => Ok(()),
            _ => Err(Error::TimedOut {
                what: "service",
                name: self.inner.name.clone(),
                waited: timeout,
            }),
        }
    }

    /// Whether a server is matched in both directions.
    pub fn server_is_ready(&self) -> bool {
        self.inner.requests.matched() > 0 && self.inner.replies_matched.matched(self.inner.reply_reader) > 0
    }

    /// Waits until [`Self::server_is_ready`].
    pub async fn wait_for_server(&self, timeout: Duration) -> Result<(), Error> {
        self.inner
            .replies_matched
            .wait_until(timeout, || self.server_is_ready())
            .await
            .map_err(|waited| Error::NotFound {
                what: "server of service",
                name: self.inner.name.clone(),
                waited,
            })
    }

    /// Fully qualified name.
    pub fn name(&self) -> &str {
        &self.inner.name
    }
}

impl<S: Service> Client<S> {
    fn send(&self, request: Arc<S::Request>) -> Result<(i64, Reply<S::Response>), Error> {
        let caller = SampleIdentity {
            writer_guid: self.reply_reader,
            sequence_number: SequenceNumber::UNKNOWN,
        };
        let options = WriteOptionsBuilder::new()
            .source_timestamp(Timestamp::now())
            .related_sample_identity(caller)
            .build();
        let (sender, receiver) = oneshot::channel();
        // The lock is held across the write: the reply may come before this thread has its number.
        let mut pending = self.pending.lock();
        let sent = self
            .requests
            .dds
            .write_with_options(request, options)
            .map_err(|e| Error::Send {
                service: self.name.clone(),
                reason: e.to_string(),
            })?;
        let sequence_number = i64::from(sent.sequence_number);
        pending.insert(sequence_number, sender);
        Ok((sequence_number, receiver))
    }
}

impl<S: Service> Drop for Client<S> {
    fn drop(&mut self) {
        self.stop.cancel();
    }
}

/// Gives every reply to the call that waits for it; replies to other clients of the service pass by.
async fn dispatch<R: Message>(
    service: String,
    replies: Reader<R>,
    own: [GUID; 2],
    pending: Arc<Mutex<Pending<R>>>,
    stop: CancellationToken,
) {
    let stream = replies.dds.as_async_stream();
    tokio::pin!(stream);
    loop {
        let arrived = tokio::select! {
            () = stop.cancelled() => return,
            Some(arrived) = stream.next() => arrived,
            else => return,
        };
        match arrived {
            Ok(sample) => {
                let Some(to) = sample
                    .related_sample_identity()
                    .filter(|to| own.contains(&to.writer_guid))
                else {
                    continue;
                };
                let waiting = pending.lock().remove(&i64::from(to.sequence_number));
                // A call that timed out no longer waits; its late reply is dropped here.
                waiting.map(|call| call.send(sample.into_value()));
            }
            Err(error) => {
                replies.graph.counters.count_unreadable();
                tracing::warn!(service, %error, "a reply is not readable; skipped");
            }
        }
    }
}
