//! Pictures in the tev viewer: what it would be told, by a small stand-in that reads its protocol.

use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::Duration;

use super::{SCENE, Watching, background, is_near, options, place, with_background};

/// What a viewer has been told of one picture.
#[derive(Debug, Default)]
struct Viewer {
    name: String,
    size: [u32; 2],
    channels: BTreeMap<String, Vec<f32>>,
    created: u32,
    closed: u32,
}

/// Reads the parts of a message.
struct Message<'a>(&'a [u8]);

impl Message<'_> {
    fn bytes<const N: usize>(&mut self) -> [u8; N] {
        let (first, rest) = self.0.split_first_chunk().expect("messages are complete");
        self.0 = rest;
        *first
    }

    fn int(&mut self) -> u32 {
        u32::from_le_bytes(self.bytes())
    }

    fn long(&mut self) -> u64 {
        u64::from_le_bytes(self.bytes())
    }

    fn text(&mut self) -> String {
        let end = self.0.iter().position(|byte| *byte == 0).expect("texts end with 0");
        let text = String::from_utf8_lossy(&self.0[..end]).into_owned();
        self.0 = &self.0[end + 1..];
        text
    }

    fn texts(&mut self) -> Vec<String> {
        (0..self.int()).map(|_| self.text()).collect()
    }
}

impl Viewer {
    /// Takes in one message.
    fn read(&mut self, stream: &mut TcpStream) {
        let mut length = [0; 4];
        stream.read_exact(&mut length).expect("there is a message");
        let mut bytes = vec![0; u32::from_le_bytes(length) as usize - 4];
        stream.read_exact(&mut bytes).expect("it is as long as announced");
        let mut message = Message(&bytes);
        match message.bytes() {
            [1..=3] => self.closed += 1,
            [4] => {
                message.bytes::<1>();
                self.name = message.text();
                self.size = [message.int(), message.int()];
                let pixels = (self.size[0] * self.size[1]) as usize;
                self.channels = message.texts().into_iter().map(|name| (name, vec![f32::NAN; pixels])).collect();
                self.created += 1;
            }
            [6] => {
                message.bytes::<1>();
                assert_eq!(message.text(), self.name);
                let names = message.texts();
                let [x, y, width, height] = std::array::from_fn(|_| message.int() as usize);
                let offsets: Vec<_> = names.iter().map(|_| message.long() as usize).collect();
                let strides: Vec<_> = names.iter().map(|_| message.long() as usize).collect();
                let data: Vec<f32> = message
                    .0
                    .chunks_exact(4)
                    .map(|bytes| f32::from_le_bytes(bytes.try_into().expect("four")))
                    .collect();
                for ((name, offset), stride) in names.iter().zip(offsets).zip(strides) {
                    let channel = self.channels.get_mut(name).expect("it was announced");
                    for row in 0..height {
                        for column in 0..width {
                            let value = data[offset + stride * (row * width + column)];
                            channel[(y + row) * self.size[0] as usize + x + column] = value;
                        }
                    }
                }
            }
            other => panic!("an unknown message: {other:?}"),
        }
    }

    /// Reads until the background is this.
    fn wait(&mut self, stream: &mut TcpStream, grey: f32) {
        while !self.channels.get("R").is_some_and(|red| is_near(red[0], grey)) {
            self.read(stream);
        }
    }
}

fn accept(listener: &TcpListener) -> TcpStream {
    let (stream, _) = listener.accept().expect("it connects");
    stream.set_read_timeout(Some(Duration::from_secs(60))).expect("time limits can be set");
    stream
}

#[test]
fn a_viewer_gets_pictures_and_so_does_the_next() {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let place = place();
    let mut options = options(&place);
    options.tev = Some(listener.local_addr().expect("it has an address").to_string());
    options.layers = vec!["rgba".into()];
    let watching = Watching::start(options);
    let mut stream = accept(&listener);
    let mut viewer = Viewer::default();
    let picture = watching.picture();
    viewer.wait(&mut stream, background(&picture));
    assert!(viewer.name.ends_with("scene.toml"));
    assert_eq!((viewer.size, viewer.created), ([32, 24], 1));
    assert_eq!(viewer.channels.keys().collect::<Vec<_>>(), ["A", "B", "G", "R"]);
    place.file("scene.toml", with_background(0.75));
    watching.picture_with("new picture", |picture| is_near(background(picture), 0.75));
    viewer.wait(&mut stream, 0.75);
    assert_eq!(viewer.created, 1);

    // It crashes; one that is started again gets the whole picture without any change.
    let _ = stream.write_all(b"");
    drop(stream);
    let mut stream = accept(&listener);
    let mut viewer = Viewer::default();
    viewer.wait(&mut stream, 0.75);
    assert_eq!(viewer.created, 1);

    // Another size is another picture.
    place.file("scene.toml", SCENE.replace("size = [32, 24]", "size = [16, 12]"));
    while viewer.size != [16, 12] {
        viewer.read(&mut stream);
    }
    viewer.wait(&mut stream, 0.25);
    assert_eq!((viewer.created, viewer.closed), (2, 1));
}

#[test]
fn without_a_viewer_everything_else_goes_on() {
    let free = TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr()).expect("a port is free");
    let place = place();
    let mut options = options(&place);
    options.tev = Some(free.to_string());
    let watching = Watching::start(options);
    let trouble = watching.wait("word of the missing viewer", |news| match news {
        tusche::live::News::Trouble(fault) => Some(fault.to_string()),
        _ => None,
    });
    assert!(trouble.contains("no tev viewer at 127.0.0.1:"), "{trouble}");
    place.file("scene.toml", with_background(0.75));
    watching.picture_with("new picture", |picture| is_near(background(picture), 0.75));
}
