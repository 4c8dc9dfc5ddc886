//! Memory for frames, which goes round: from the stream to whoever uses the image, and back when it is dropped.
//!
//! A fresh buffer of 4.7 MB costs the kernel a thousand page faults, in the middle of a capture. One that comes back
//! costs nothing, and nothing is copied on the way.

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use aravis::Buffer;
use bytes::Bytes;

/// Buffers of one size.
#[derive(Debug)]
pub(super) struct Buffers {
    bytes: usize,
    home: SyncSender<Buffer>,
    returned: Receiver<Buffer>,
}

impl Buffers {
    /// Keeps at most `most` buffers that nobody uses.
    pub(super) fn new(bytes: usize, most: usize) -> Self {
        let (home, returned) = sync_channel(most);
        Self { bytes, home, returned }
    }

    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }

    /// A buffer for the stream to fill.
    pub(super) fn take(&self) -> Buffer {
        let buffer = self.returned.try_recv().unwrap_or_else(|_| fresh(self.bytes));
        clear(&buffer);
        buffer
    }

    /// The content of a buffer that was filled whole.
    pub(super) fn share(&self, buffer: Buffer) -> Bytes {
        Bytes::from_owner(Pixels {
            bytes: self.bytes,
            buffer: Some(buffer),
            home: self.home.clone(),
        })
    }
}

/// So that a frame of which only parts arrive does not carry an earlier frame's number and time.
pub(super) fn clear(buffer: &Buffer) {
    buffer.set_frame_id(0);
    buffer.set_timestamp(0);
}

/// Written to once, so that every page is there before the first packet.
fn fresh(bytes: usize) -> Buffer {
    let buffer = Buffer::new_allocate(bytes);
    let (data, _) = buffer.data();
    #[expect(unsafe_code, reason = "Aravis hands out its memory as a pointer")]
    // SAFETY: Aravis allocated `bytes` bytes there, and nobody else knows the buffer yet.
    unsafe {
        data.write_bytes(0, bytes);
    }
    buffer
}

/// A filled buffer, seen as bytes.
struct Pixels {
    bytes: usize,
    /// There until it is dropped.
    buffer: Option<Buffer>,
    home: SyncSender<Buffer>,
}

impl AsRef<[u8]> for Pixels {
    fn as_ref(&self) -> &[u8] {
        let Some(buffer) = &self.buffer else { return &[] };
        let (data, _) = buffer.data();
        #[expect(unsafe_code, reason = "Aravis hands out its memory as a pointer")]
        // SAFETY: `fresh` allocated and wrote `bytes` bytes there. The stream has handed the buffer over and gets it
        // back only when this is dropped, so nobody writes to it meanwhile.
        unsafe {
            std::slice::from_raw_parts(data, self.bytes)
        }
    }
}

impl Drop for Pixels {
    fn drop(&mut self) {
        if let Some(buffer) = self.buffer.take() {
            // One too many, or one of a size that is not used any more, is freed.
            let _ = self.home.try_send(buffer);
        }
    }
}
