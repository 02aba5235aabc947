//! Pictures in the tev viewer, over its TCP protocol.
//!
//! A thread of its own sends the newest picture and waits for the viewer where it is slow or not there; pictures in
//! between are skipped. A viewer that is started later, or again, gets the whole picture within [`RETRY`].

use std::io::ErrorKind;
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use tev_client::{PacketCloseImage, PacketCreateImage, PacketUpdateImage, TevClient};

use super::LivePicture;
use crate::diag::Diagnostic;
use crate::film::Layer;
use crate::sample::PixelRect;

/// Where tev listens unless told otherwise.
pub const DEFAULT_ADDRESS: &str = "127.0.0.1:14158";

/// How often a viewer that is not there is looked for, and one that is there is looked at.
const RETRY: Duration = Duration::from_secs(1);
/// How long a viewer may take to answer, or to take in a part of a picture.
const PATIENCE: Duration = Duration::from_secs(10);
/// Most values in one message, whose length in bytes has 32 bits.
const MOST_VALUES: usize = 1 << 24;

/// A viewer, connected or not.
pub(super) struct Tev {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    /// The newest picture, and what has changed since the sender last took one.
    picture: Option<(Arc<LivePicture>, Option<PixelRect>)>,
    closed: bool,
}

impl Tev {
    /// Begins to look for a viewer at `HOST:PORT`. `told` hears when one is found or lost, from another thread.
    pub fn start(
        address: String,
        name: String,
        told: impl Fn(Result<String, Diagnostic>) + Send + 'static,
    ) -> Result<Self, Diagnostic> {
        let shared = Arc::new(Shared::default());
        let of_thread = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("tev".into())
            .spawn(move || Sender { shared: of_thread, address, name, told, lost: false }.work())
            .map_err(|error| Diagnostic::error(format!("cannot start a thread: {error}")))?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// Shows a picture as soon as the viewer can take it.
    pub fn show(&self, picture: &Arc<LivePicture>) {
        let mut state = self.shared.lock();
        // Of a picture that was skipped, nobody knows what it changed: the sum is what is missing.
        let missed = match state.picture.take() {
            Some((_, Some(missed))) => Some(missed),
            _ => None,
        };
        let changed = missed.map_or(picture.changed, |missed| PixelRect {
            x0: missed.x0.min(picture.changed.x0),
            y0: missed.y0.min(picture.changed.y0),
            x1: missed.x1.max(picture.changed.x1),
            y1: missed.y1.max(picture.changed.y1),
        });
        state.picture = Some((Arc::clone(picture), Some(changed)));
        self.shared.changed.notify_all();
    }
}

impl Drop for Tev {
    fn drop(&mut self) {
        self.shared.lock().closed = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for a picture to send, but not longer than [`RETRY`]. `None` at the end of all.
    fn wait(&self) -> Option<Option<(Arc<LivePicture>, PixelRect)>> {
        let mut state = self.lock();
        let is_idle =
            |state: &mut State| !state.closed && state.picture.as_ref().is_none_or(|(_, changed)| changed.is_none());
        if is_idle(&mut state) {
            state = self.changed.wait_timeout_while(state, RETRY, is_idle).unwrap_or_else(PoisonError::into_inner).0;
        }
        if state.closed {
            return None;
        }
        let Some((picture, changed)) = &mut state.picture else { return Some(None) };
        Some(changed.take().map(|changed| (Arc::clone(picture), changed)))
    }

    /// Waits a while, or until the end: then false.
    fn pause(&self) -> bool {
        let state = self.lock();
        let waited = self.changed.wait_timeout_while(state, RETRY, |state| !state.closed);
        !waited.unwrap_or_else(PoisonError::into_inner).0.closed
    }

    fn last(&self) -> Option<Arc<LivePicture>> {
        self.lock().picture.as_ref().map(|(picture, _)| Arc::clone(picture))
    }
}

struct Sender<F> {
    shared: Arc<Shared>,
    address: String,
    name: String,
    told: F,
    /// Whether it was said that there is no viewer.
    lost: bool,
}

/// A viewer that is there, and what it shows.
struct Viewer {
    client: TevClient,
    /// The same connection, to see whether it still stands.
    stream: TcpStream,
    shown: Option<(Vec<Layer>, [u32; 2])>,
}

impl<F: Fn(Result<String, Diagnostic>)> Sender<F> {
    fn work(mut self) {
        loop {
            let mut viewer = match self.connect() {
                Ok(viewer) => viewer,
                Err(error) => {
                    self.lose(&error);
                    if !self.shared.pause() {
                        return;
                    }
                    continue;
                }
            };
            self.lost = false;
            (self.told)(Ok(format!("pictures go to the tev viewer at {}", self.address)));
            // One that has come back knows nothing of what was sent before.
            let mut whole = self.shared.last();
            let error = loop {
                let Some(next) = self.shared.wait() else { return };
                let all = |picture: &LivePicture| PixelRect::of_size(picture.size);
                let next = match (next, whole.take()) {
                    (Some((picture, _)), Some(_)) => Some((all(&picture), picture)),
                    (None, Some(picture)) => Some((all(&picture), picture)),
                    (Some((picture, changed)), None) => Some((changed, picture)),
                    (None, None) => None,
                };
                let result = match next {
                    Some((rect, picture)) => viewer.show(&self.name, &picture, rect),
                    None => viewer.check(),
                };
                if let Err(error) = result {
                    break error;
                }
            };
            self.lose(&error);
        }
    }

    fn connect(&self) -> std::io::Result<Viewer> {
        let mut error = std::io::Error::new(ErrorKind::NotFound, "no such host");
        for address in self.address.to_socket_addrs()? {
            match TcpStream::connect_timeout(&address, RETRY) {
                Ok(stream) => {
                    stream.set_write_timeout(Some(PATIENCE))?;
                    stream.set_nodelay(true)?;
                    return Ok(Viewer { client: TevClient::wrap(stream.try_clone()?), stream, shown: None });
                }
                Err(refused) => error = refused,
            }
        }
        Err(error)
    }

    fn lose(&mut self, error: &std::io::Error) {
        if !std::mem::replace(&mut self.lost, true) {
            let fault = Diagnostic::warning(format!("no tev viewer at {}: {error}", self.address));
            (self.told)(Err(fault.hint("start tev; it is found within a second")));
        }
    }
}

impl Viewer {
    /// Whether the viewer is still there. It never says anything.
    fn check(&self) -> std::io::Result<()> {
        self.stream.set_nonblocking(true)?;
        let peeked = self.stream.peek(&mut [0]);
        self.stream.set_nonblocking(false)?;
        match peeked {
            Ok(0) => Err(ErrorKind::ConnectionReset.into()),
            Err(error) if error.kind() != ErrorKind::WouldBlock => Err(error),
            _ => Ok(()),
        }
    }

    fn show(&mut self, name: &str, picture: &LivePicture, changed: PixelRect) -> std::io::Result<()> {
        self.check()?;
        let key = (picture.layers.clone(), picture.size);
        let all = PixelRect::of_size(picture.size);
        let mut rect = changed.intersection(&all);
        if self.shown.as_ref() != Some(&key) {
            if self.shown.is_some() {
                self.client.send(PacketCloseImage { image_name: name })?;
            }
            let names: Vec<_> = picture.layers.iter().flat_map(Layer::channels).map(|channel| channel.name).collect();
            let [width, height] = picture.size;
            self.client.send(PacketCreateImage {
                image_name: name,
                grab_focus: self.shown.is_none(),
                width,
                height,
                channel_names: &names,
            })?;
            self.shown = Some(key);
            rect = all;
        }
        let mut first = 0;
        for layer in &picture.layers {
            let count = layer.channels().len();
            self.update(name, picture, layer, &picture.channels[first..first + count], rect)?;
            first += count;
        }
        Ok(())
    }

    fn update(
        &mut self,
        name: &str,
        picture: &LivePicture,
        layer: &Layer,
        channels: &[Vec<f32>],
        rect: PixelRect,
    ) -> std::io::Result<()> {
        if rect.pixels() == 0 {
            return Ok(());
        }
        let names: Vec<_> = layer.channels().into_iter().map(|channel| channel.name).collect();
        let rows = (MOST_VALUES / (rect.width() as usize * channels.len())).max(1);
        for y0 in (rect.y0..rect.y1).step_by(rows) {
            let band = PixelRect { y0, y1: rect.y1.min(y0 + rows as i32), ..rect };
            let mut data = Vec::with_capacity(band.pixels() * channels.len());
            for channel in channels {
                for y in band.y0..band.y1 {
                    let start = y as usize * picture.size[0] as usize;
                    let row = &channel[start + band.x0 as usize..start + band.x1 as usize];
                    match layer {
                        #[expect(clippy::cast_precision_loss, reason = "the viewer knows floats only")]
                        Layer::Object => data.extend(row.iter().map(|id| id.to_bits() as f32)),
                        _ => data.extend_from_slice(row),
                    }
                }
            }
            let offsets: Vec<_> = (0..channels.len()).map(|channel| (channel * band.pixels()) as u64).collect();
            self.client.send(PacketUpdateImage {
                image_name: name,
                grab_focus: false,
                channel_names: &names,
                channel_offsets: &offsets,
                channel_strides: &vec![1; channels.len()],
                x: band.x0 as u32,
                y: band.y0 as u32,
                width: band.width(),
                height: band.height(),
                data: &data,
            })?;
        }
        Ok(())
    }
}
