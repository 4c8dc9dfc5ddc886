use std::net::TcpListener;
use std::time::Duration;

use rustix::net::sockopt;
use xarm_protocol::{Frame, FrameReader, Reply, register};

use super::*;

const HERE: JointValues = [0.1; 7];

/// A stream with small buffers, and the controller's end of it.
fn connected() -> (Stream, TcpStream) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    sockopt::set_socket_recv_buffer_size(&listener, 2048).expect("a small buffer");
    let socket = TcpStream::connect(listener.local_addr().expect("it is bound")).expect("it listens");
    sockopt::set_socket_send_buffer_size(&socket, 2048).expect("a small buffer");
    socket.set_nonblocking(true).expect("it does not block");
    let (controller, _) = listener.accept().expect("it was connected");
    controller
        .set_read_timeout(Some(Duration::from_millis(200)))
        .expect("it may wait");
    (Stream::new(socket, HERE), controller)
}

fn reply(status: Status) -> Vec<u8> {
    let reply = Reply {
        register: register::SERVO_JOINT,
        status,
        data: Vec::new(),
    };
    reply.frame(1, Protocol::Private).encode()
}

/// Replies are on their way for a moment even on one host.
fn send_until_fault(stream: &mut Stream) -> StreamFault {
    (0..10_000)
        .find_map(|_| {
            std::thread::yield_now();
            stream.send(&HERE).err()
        })
        .expect("it ends")
}

fn frames(mut controller: &TcpStream) -> Vec<Frame> {
    let (mut reader, mut buffer, mut frames) = (FrameReader::default(), [0; 4096], Vec::new());
    while let Ok(count @ 1..) = controller.read(&mut buffer) {
        reader.push(&buffer[..count]);
        while let Some(frame) = reader.next().expect("frames are whole") {
            frames.push(frame);
        }
    }
    frames
}

#[test]
fn a_controller_that_answers_nothing_is_silent_after_20_set_points() {
    let (mut stream, _controller) = connected();
    for number in 0..MOST_UNANSWERED {
        assert_eq!(stream.send(&HERE), Ok(()), "{number}");
    }
    assert_eq!(stream.send(&HERE), Err(StreamFault::Silent));
}

#[test]
fn what_the_controller_says_ends_the_stream() {
    let says = [
        (Status::NOT_READY, StreamFault::NotReady),
        (Status::INVALID, StreamFault::Refused),
        (Status::ERROR.and(Status::NOT_READY), StreamFault::ControllerError),
    ];
    for (status, fault) in says {
        let (mut stream, mut controller) = connected();
        stream.send(&HERE).expect("it is connected");
        controller.write_all(&reply(status)).expect("it is connected");
        assert_eq!(send_until_fault(&mut stream), fault);
        assert_eq!(stream.send(&HERE), Err(fault), "it does not go on");
    }
}

#[test]
fn a_warning_ends_nothing() {
    let (mut stream, mut controller) = connected();
    for _ in 0..3 * MOST_UNANSWERED {
        stream.send(&HERE).expect("it goes on");
        controller.write_all(&reply(Status::WARNING)).expect("it is connected");
        // Waits for the set-point, and so for the reply of the one before to be there.
        frames_of_one(&controller);
    }
}

fn frames_of_one(mut controller: &TcpStream) {
    let mut frame = [0; 47];
    controller.read_exact(&mut frame).expect("a set-point has 47 bytes");
}

#[test]
fn a_connection_that_takes_nothing_is_lost_and_what_it_took_is_whole() {
    let (mut stream, mut controller) = connected();
    let fault = loop {
        // It answers without reading, so that it is not silent.
        controller.write_all(&reply(Status::FINE)).expect("it is connected");
        stream.unanswered = 0;
        if let Err(fault) = stream.send(&HERE) {
            break fault;
        }
    };
    assert_eq!(fault, StreamFault::Disconnected);
    assert!(stream.sent < stream.frame.len(), "the last one waits");
    let frames = frames(&controller);
    assert!(frames.len() > 20, "{}", frames.len());
    for (number, frame) in frames.iter().enumerate() {
        assert_eq!(
            usize::from(frame.transaction),
            number + 1,
            "none is missing before the last"
        );
        assert_eq!(
            (frame.register(), frame.parameters().len()),
            (register::SERVO_JOINT, 40)
        );
    }
}

#[test]
fn a_connection_that_was_held_up_goes_on_where_it_was() {
    let (mut stream, mut controller) = connected();
    while stream.blocked == 0 {
        controller.write_all(&reply(Status::FINE)).expect("it is connected");
        stream.unanswered = 0;
        stream.send(&HERE).expect("it may be held up a little");
    }
    let before = frames(&controller).len();
    for _ in 0..3 {
        stream.send(&HERE).expect("there is room again");
    }
    assert_eq!(stream.blocked, 0);
    let after = frames(&controller);
    assert_eq!(
        before + after.len(),
        usize::from(after.last().expect("some came").transaction)
    );
}

#[test]
fn a_closed_connection_is_lost() {
    let (mut stream, controller) = connected();
    drop(controller);
    assert_eq!(send_until_fault(&mut stream), StreamFault::Disconnected);
}
