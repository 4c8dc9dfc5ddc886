//! A client of the control port that knows nothing but frames.

use std::collections::VecDeque;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

use sim::arm::{ArmConfig, ArmController, ArmMoment};
use xarm_protocol::{
    Feedback, Frame, FrameReader, Mode, MoveJoint, MoveLine, Protocol, Reply, Report, ReportKind, ReportReader,
    Request, State, StateCommand, Status, Transactions,
};

/// Longer than anything takes that these tests wait for, also on a busy machine.
pub(crate) const PATIENCE: Duration = Duration::from_secs(20);

pub(crate) struct Client {
    stream: TcpStream,
    reader: FrameReader,
    transactions: Transactions,
    pub(crate) feedback: VecDeque<Feedback>,
}

impl Client {
    pub(crate) fn connect(arm: &ArmController) -> Self {
        let place = SocketAddr::from((arm.address(), arm.ports().control));
        let stream = TcpStream::connect(place).expect("the control port is open");
        stream.set_read_timeout(Some(PATIENCE)).expect("a timeout can be set");
        stream.set_nodelay(true).expect("delays can be switched off");
        Self {
            stream,
            reader: FrameReader::default(),
            transactions: Transactions::default(),
            feedback: VecDeque::new(),
        }
    }

    /// The next frame; none when the connection is closed.
    pub(crate) fn read(&mut self) -> Option<Frame> {
        let mut buffer = [0; 1024];
        loop {
            if let Some(frame) = self.reader.next().expect("the controller sends frames") {
                return Some(frame);
            }
            match self.stream.read(&mut buffer) {
                Ok(0) => return None,
                Ok(count) => self.reader.push(&buffer[..count]),
                Err(error) if error.kind() == std::io::ErrorKind::ConnectionReset => return None,
                Err(error) => panic!("no answer: {error}"),
            }
        }
    }

    pub(crate) fn send(&mut self, bytes: &[u8]) {
        self.stream.write_all(bytes).expect("the connection is open");
    }

    /// Sends a request and returns its number.
    pub(crate) fn post(&mut self, request: &Request) -> u16 {
        let transaction = self.transactions.next_number();
        self.send(&request.frame(transaction, Protocol::KeepAlive).encode());
        transaction
    }

    /// The answer; feedback that comes before is kept.
    pub(crate) fn call(&mut self, request: &Request) -> Reply {
        let transaction = self.post(request);
        self.reply_to(transaction)
    }

    pub(crate) fn reply_to(&mut self, transaction: u16) -> Reply {
        loop {
            let frame = self.read().expect("an answer");
            if Feedback::is(&frame) {
                self.feedback.push_back(Feedback::of_frame(&frame).expect("feedback"));
                continue;
            }
            assert_eq!((frame.transaction, frame.protocol), (transaction, Protocol::KeepAlive));
            return Reply::of_frame(&frame).expect("a reply");
        }
    }

    /// What is told next without being asked.
    pub(crate) fn next_feedback(&mut self) -> Feedback {
        self.feedback.pop_front().unwrap_or_else(|| {
            let frame = self.read().expect("feedback");
            Feedback::of_frame(&frame).expect("nothing but feedback comes unasked")
        })
    }

    /// The answer, which must be fine.
    pub(crate) fn fine(&mut self, request: &Request) -> Reply {
        let reply = self.call(request);
        assert_eq!(reply.status, Status::FINE, "{request:?}");
        reply
    }

    pub(crate) fn state(&mut self) -> State {
        let [state] = self.call(&Request::GetState).read_bytes().expect("a state");
        State::try_from(state).expect("a state")
    }

    /// Error and warning.
    pub(crate) fn error(&mut self) -> [u8; 2] {
        self.call(&Request::GetError).read_bytes().expect("two numbers")
    }

    /// As every client begins, and how it gets out of an error.
    pub(crate) fn enable(&mut self, mode: Mode) {
        self.call(&Request::CleanError);
        self.call(&Request::CleanWarning);
        self.call(&Request::MotionEnable { axis: 8, on: true });
        self.call(&Request::SetMode(mode));
        self.fine(&Request::SetState(StateCommand::Run));
    }

    pub(crate) fn joints(&mut self) -> [f64; 7] {
        let reply = self.call(&Request::GetJoints { parts: None });
        reply.read_floats::<7>().expect("seven angles").map(f64::from)
    }

    pub(crate) fn pose(&mut self) -> [f32; 6] {
        self.call(&Request::GetTcpPose).read_floats().expect("six numbers")
    }
}

pub(crate) fn start() -> ArmController {
    ArmController::start(ArmConfig::default()).expect("an arm")
}

pub(crate) fn of_firmware(version: &str) -> ArmConfig {
    let mut config = ArmConfig::default();
    config.identity.firmware = version.parse().expect("a version");
    config
}

pub(crate) fn joint_move(angles: [f32; 7], speed: f32) -> Request {
    Request::MoveJoint(MoveJoint {
        angles,
        speed,
        acceleration: 10.0,
        radius: None,
        time: 0.0,
        check_only: None,
    })
}

pub(crate) fn line(pose: [f32; 6], speed: f32) -> Request {
    Request::MoveLine(MoveLine {
        pose,
        speed,
        acceleration: 1000.0,
        time: 0.0,
        options: None,
    })
}

pub(crate) fn servo(angles: [f64; 7]) -> Request {
    Request::ServoJoint {
        angles: angles.map(|angle| angle as f32),
        speed: 0.0,
        acceleration: 0.0,
        time: 0.0,
    }
}

/// The arm as soon as it is as wanted.
pub(crate) fn wait_for(arm: &ArmController, what: &str, is_so: impl Fn(&ArmMoment) -> bool) -> ArmMoment {
    let end = Instant::now() + PATIENCE;
    loop {
        let moment = arm.moment();
        if is_so(&moment) {
            return moment;
        }
        assert!(Instant::now() < end, "waited for {what}: {moment:?}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

pub(crate) fn rests(moment: &ArmMoment) -> bool {
    moment.velocities.iter().all(|velocity| velocity.abs() < 1e-9)
}

/// Whether the arm stands still again and takes commands.
pub(crate) fn is_done(moment: &ArmMoment) -> bool {
    moment.state == State::Ready && rests(moment)
}

pub(crate) fn distance(a: &[f64; 7], b: &[f64; 7]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Reports of a port.
pub(crate) struct Reports {
    stream: TcpStream,
    reader: ReportReader,
}

impl Reports {
    pub(crate) fn connect(arm: &ArmController, kind: ReportKind) -> Self {
        let place = SocketAddr::from((arm.address(), arm.ports().of_reports(kind)));
        let stream = TcpStream::connect(place).expect("the report port is open");
        stream.set_read_timeout(Some(PATIENCE)).expect("a timeout can be set");
        Self {
            stream,
            reader: ReportReader::new(kind),
        }
    }

    /// The next one; none when the connection is closed.
    pub(crate) fn read(&mut self) -> Option<Result<Report, xarm_protocol::ProtocolError>> {
        let mut buffer = [0; 1024];
        loop {
            match self.reader.next() {
                Ok(Some(report)) => return Some(Ok(report)),
                Ok(None) => {}
                Err(error) => return Some(Err(error)),
            }
            match self.stream.read(&mut buffer) {
                Ok(0) => return None,
                Ok(count) => self.reader.push(&buffer[..count]),
                Err(error) => panic!("no report: {error}"),
            }
        }
    }

    pub(crate) fn next(&mut self) -> Report {
        self.read().expect("reports go on").expect("a report")
    }
}
