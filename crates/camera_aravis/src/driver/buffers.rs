//! Memory for frames, which goes round: from the stream to whoever uses the image, and back when it is dropped.
//!
//! Fresh memory for 4.7 MB costs the kernel a thousand page faults, in the middle of a capture. What comes back costs
//! nothing, and nothing is copied on the way.

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use aravis::Buffer;
use bytes::Bytes;

/// Buffers of one size.
#[derive(Debug)]
pub(super) struct Buffers {
    bytes: usize,
    home: SyncSender<Vec<u8>>,
    returned: Receiver<Vec<u8>>,
}

impl Buffers {
    /// Keeps at most `most` of them while nobody uses them.
    pub(super) fn new(bytes: usize, most: usize) -> Self {
        let (home, returned) = sync_channel(most);
        Self { bytes, home, returned }
    }

    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }

    /// A buffer for the stream to fill. Its memory comes back when the last reference to it is gone, be that the
    /// stream's or an image's.
    pub(super) fn take(&self) -> Buffer {
        let mut memory = self.returned.try_recv().unwrap_or_else(|_| touched(self.bytes));
        let (data, bytes) = (memory.as_mut_ptr(), memory.len());
        let home = self.home.clone();
        let buffer = Buffer::new_preallocated_owned(data, bytes, move || {
            // One too many, or one of a size that is not used any more, is freed.
            let _ = home.try_send(memory);
        });
        clear(&buffer);
        buffer
    }
}

/// So that a frame of which only parts arrive does not carry an earlier frame's number and time.
pub(super) fn clear(buffer: &Buffer) {
    buffer.set_frame_id(0);
    buffer.set_timestamp(0);
}

/// Written to once, so that every page is there before the first packet. Zeros would not be written.
fn touched(bytes: usize) -> Vec<u8> {
    vec![0xff; bytes]
}

/// The content of a buffer that was filled whole.
pub(super) fn share(buffer: Buffer) -> Bytes {
    Bytes::from_owner(Pixels(buffer))
}

/// A filled buffer of [`Buffers::take`], seen as bytes.
struct Pixels(Buffer);

impl AsRef<[u8]> for Pixels {
    fn as_ref(&self) -> &[u8] {
        let (data, received) = self.0.data();
        #[expect(unsafe_code, reason = "Aravis hands out its memory as a pointer")]
        // SAFETY: the memory is that of `Buffers::take`, initialised, alive as long as the buffer is, and Aravis never
        // receives more than it holds. The stream has handed the buffer over and does not get it back, so nobody
        // writes to it.
        unsafe {
            std::slice::from_raw_parts(data, received)
        }
    }
}
