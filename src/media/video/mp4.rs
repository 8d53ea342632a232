//! The MP4 container (ISO/IEC 14496-12, 14496-15): one H.264 track, with the index before the frames so that browsers
//! can start playback at once.
//!
//! Written by hand: the crate `mp4` writes the index after the frames and no colour information (`colr`).

/// Clock ticks per frame.
const TICKS: u32 = 1000;

struct Sample {
    bytes: Vec<u8>,
    is_key: bool,
}

pub(super) struct Track {
    width: usize,
    height: usize,
    rate: u32,
    /// Sequence and picture parameter sets, without start codes.
    sps: Vec<u8>,
    pps: Vec<u8>,
    samples: Vec<Sample>,
}

impl Track {
    pub(super) fn new(width: usize, height: usize, rate: u32) -> Self {
        Self { width, height, rate, sps: Vec::new(), pps: Vec::new(), samples: Vec::new() }
    }

    pub(super) fn len(&self) -> usize {
        self.samples.len()
    }

    /// Appends an access unit in Annex B format: parameter sets go to the index, slices are
    /// prefixed with their lengths.
    pub(super) fn push(&mut self, unit: &[u8]) {
        let mut sample = Sample { bytes: Vec::with_capacity(unit.len()), is_key: false };
        for nal in nal_units(unit) {
            match nal[0] & 31 {
                7 => self.sps = nal.to_vec(),
                8 => self.pps = nal.to_vec(),
                kind => {
                    sample.is_key |= kind == 5;
                    sample.bytes.extend((nal.len() as u32).to_be_bytes());
                    sample.bytes.extend(nal);
                }
            }
        }
        self.samples.push(sample);
    }

    pub(super) fn file(&self) -> Vec<u8> {
        let brands = b"isomiso2avc1mp41";
        let mut file = mp4_box(b"ftyp", &[b"isom".as_slice(), &512_u32.to_be_bytes(), brands].concat());
        // The index contains the offset of the first frame, which follows it. Its length does not depend on the value.
        let first_frame = file.len() + self.moov(0).len() + 8;
        file.extend(self.moov(first_frame as u32));
        let frames: Vec<u8> = self.samples.iter().flat_map(|s| s.bytes.iter().copied()).collect();
        file.extend(mp4_box(b"mdat", &frames));
        file
    }

    fn moov(&self, first: u32) -> Vec<u8> {
        let scale = self.rate * TICKS;
        let duration = self.samples.len() as u32 * TICKS;
        let mvhd =
            BoxFields::full(0).u32s(&[0, 0, scale, duration, 0x0001_0000]).u16s(&[0x0100, 0]).u32s(&[0, 0]);
        let mvhd = mvhd.u32s(&MATRIX).u32s(&[0; 6]).u32s(&[2]);
        // Flags 3: the track is enabled and part of the presentation.
        let tkhd = BoxFields::full(3).u32s(&[0, 0, 1, 0, duration, 0, 0]).u16s(&[0, 0, 0, 0]).u32s(&MATRIX);
        let tkhd = tkhd.u32s(&[(self.width as u32) << 16, (self.height as u32) << 16]);
        // 0x55c4: language undetermined.
        let mdhd = BoxFields::full(0).u32s(&[0, 0, scale, duration]).u16s(&[0x55c4, 0]);
        let hdlr = BoxFields::full(0).u32s(&[0]).bytes(b"vide").u32s(&[0; 3]).bytes(b"softvt\0");
        let vmhd = BoxFields::full(1).u16s(&[0; 4]);
        let dref = BoxFields::full(0).u32s(&[1]).bytes(&mp4_box(b"url ", &BoxFields::full(1).0));
        let minf = [
            mp4_box(b"vmhd", &vmhd.0),
            mp4_box(b"dinf", &mp4_box(b"dref", &dref.0)),
            mp4_box(b"stbl", &self.sample_table(first)),
        ];
        let mdia = [mp4_box(b"mdhd", &mdhd.0), mp4_box(b"hdlr", &hdlr.0), mp4_box(b"minf", &minf.concat())];
        let trak = [mp4_box(b"tkhd", &tkhd.0), mp4_box(b"mdia", &mdia.concat())];
        mp4_box(b"moov", &[mp4_box(b"mvhd", &mvhd.0), mp4_box(b"trak", &trak.concat())].concat())
    }

    fn sample_table(&self, first: u32) -> Vec<u8> {
        let count = self.samples.len() as u32;
        let stsd = BoxFields::full(0).u32s(&[1]).bytes(&self.sample_entry());
        let stts = BoxFields::full(0).u32s(&[1, count, TICKS]);
        let keys = self.samples.iter().zip(1_u32..).filter(|(s, _)| s.is_key).map(|(_, number)| number);
        let keys: Vec<u32> = keys.collect();
        let stss = BoxFields::full(0).u32s(&[keys.len() as u32]).u32s(&keys);
        let stsc = BoxFields::full(0).u32s(&[1, 1, count, 1]);
        let sizes: Vec<u32> = self.samples.iter().map(|s| s.bytes.len() as u32).collect();
        let stsz = BoxFields::full(0).u32s(&[0, count]).u32s(&sizes);
        let stco = BoxFields::full(0).u32s(&[1, first]);
        let boxes = [
            (b"stsd", stsd),
            (b"stts", stts),
            (b"stss", stss),
            (b"stsc", stsc),
            (b"stsz", stsz),
            (b"stco", stco),
        ];
        boxes.iter().flat_map(|(name, fields)| mp4_box(name, &fields.0)).collect()
    }

    /// The `avc1` entry: size, decoder configuration and colour space (BT.601 primaries, transfer
    /// and matrix; studio range).
    fn sample_entry(&self) -> Vec<u8> {
        let (sps, pps) = (&self.sps, &self.pps);
        let profile = [1, sps[1], sps[2], sps[3], 0xff, 0xe1];
        let avcc = BoxFields(profile.to_vec()).u16s(&[sps.len() as u16]).bytes(sps).bytes(&[1]);
        let avcc = avcc.u16s(&[pps.len() as u16]).bytes(pps);
        let colr = BoxFields(b"nclx".to_vec()).u16s(&[6, 6, 6]).bytes(&[0]);
        let entry =
            BoxFields(vec![0; 6]).u16s(&[1]).u16s(&[0; 8]).u16s(&[self.width as u16, self.height as u16]);
        // 72 dpi, one frame per sample, no name, 24 bits per pixel, no colour table.
        let entry = entry.u32s(&[0x0048_0000, 0x0048_0000, 0]).u16s(&[1]).bytes(&[0; 32]).u16s(&[24, 0xffff]);
        mp4_box(b"avc1", &entry.bytes(&mp4_box(b"avcC", &avcc.0)).bytes(&mp4_box(b"colr", &colr.0)).0)
    }
}

/// The identity (16.16 and 2.30 fixed point).
const MATRIX: [u32; 9] = [0x0001_0000, 0, 0, 0, 0x0001_0000, 0, 0, 0, 0x4000_0000];

fn mp4_box(name: &[u8; 4], payload: &[u8]) -> Vec<u8> {
    [&(payload.len() as u32 + 8).to_be_bytes(), name.as_slice(), payload].concat()
}

struct BoxFields(Vec<u8>);

impl BoxFields {
    /// Version 0 and flags.
    fn full(flags: u32) -> Self {
        Self(flags.to_be_bytes().to_vec())
    }

    fn u32s(mut self, values: &[u32]) -> Self {
        values.iter().for_each(|v| self.0.extend(v.to_be_bytes()));
        self
    }

    fn u16s(mut self, values: &[u16]) -> Self {
        values.iter().for_each(|v| self.0.extend(v.to_be_bytes()));
        self
    }

    fn bytes(mut self, values: &[u8]) -> Self {
        self.0.extend(values);
        self
    }
}

/// Splits an Annex B stream (ITU-T H.264, B.1) at its start codes into non-empty units without them.
fn nal_units(stream: &[u8]) -> impl Iterator<Item = &[u8]> {
    let starts: Vec<usize> =
        (0..stream.len().saturating_sub(2)).filter(|&i| stream[i..i + 3] == [0, 0, 1]).collect();
    let ends = starts.iter().skip(1).copied().chain([stream.len()]).collect::<Vec<_>>();
    let units = starts.into_iter().zip(ends).map(|(start, end)| {
        let unit = &stream[start + 3..end];
        // The first zero of a four-byte start code ends up at the end of the previous unit; units never end in zero.
        &unit[..unit.iter().rposition(|b| *b != 0).map_or(0, |last| last + 1)]
    });
    units.filter(|unit| !unit.is_empty())
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VideoInfo {
    pub frames: usize,
    pub frame_rate: f64,
}

impl VideoInfo {
    /// Reads the index of an MP4 file with one track; `None` if it is not such a file or truncated.
    pub fn read(file: &[u8]) -> Option<Self> {
        let media = find_box(find_box(find_box(file, b"moov")?, b"trak")?, b"mdia")?;
        let table = find_box(find_box(media, b"minf")?, b"stbl")?;
        let sizes = find_box(table, b"stsz")?;
        let frames = read_u32(sizes, 8)? as usize;
        let header = find_box(media, b"mdhd")?;
        let (scale, duration) = (read_u32(header, 12)?, read_u32(header, 16)?);
        let sizes = sizes.get(12..)?.as_chunks::<4>().0;
        let expected: usize = sizes.iter().map(|size| u32::from_be_bytes(*size) as usize).sum();
        let is_complete = sizes.len() == frames && expected == find_box(file, b"mdat")?.len() && duration > 0;
        let frame_rate = f64::from(scale) * frames as f64 / f64::from(duration);
        is_complete.then_some(Self { frames, frame_rate })
    }
}

fn find_box<'a>(mut boxes: &'a [u8], name: &[u8; 4]) -> Option<&'a [u8]> {
    loop {
        let size = read_u32(boxes, 0)? as usize;
        let whole = boxes.get(..size).filter(|_| size >= 8)?;
        if &whole[4..8] == name {
            return whole.get(8..);
        }
        boxes = &boxes[size..];
    }
}

fn read_u32(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_be_bytes(bytes.get(at..at + 4)?.try_into().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::video::VideoWriter;

    #[test]
    fn length_and_rate_are_read_from_the_index_and_a_truncated_file_has_none() {
        let mut video = VideoWriter::new(32, 48, 20).unwrap();
        (0..7).for_each(|shade| video.push(&vec![30 * shade; 32 * 48 * 3]).unwrap());
        let file = video.finish().unwrap();
        assert_eq!(VideoInfo::read(&file), Some(VideoInfo { frames: 7, frame_rate: 20.0 }));
        for truncated in [&file[..file.len() - 1], &file[..100], b"hello"] {
            assert_eq!(VideoInfo::read(truncated), None);
        }
    }

    #[test]
    fn units_are_split_at_three_and_four_byte_start_codes() {
        let stream = [0, 0, 0, 1, 0x67, 5, 0, 0, 1, 0x68, 6, 0, 0, 0, 1, 0x65, 7, 8];
        let units: Vec<_> = nal_units(&stream).collect();
        assert_eq!(units, [&[0x67, 5][..], &[0x68, 6], &[0x65, 7, 8]]);
    }

    #[test]
    fn the_index_points_at_the_frames() {
        let mut track = Track::new(32, 32, 20);
        track.push(&[0, 0, 0, 1, 0x67, 66, 192, 30, 0, 0, 0, 1, 0x68, 1, 0, 0, 0, 1, 0x65, 7, 8]);
        track.push(&[0, 0, 0, 1, 0x41, 9]);
        let file = track.file();
        let find = |name: &[u8]| file.windows(4).position(|w| w == name).unwrap() + 4;
        let number = |at: usize| u32::from_be_bytes(file[at..at + 4].try_into().unwrap()) as usize;
        let first = number(find(b"stco") + 8);
        assert_eq!(first, find(b"mdat"));
        let sizes = find(b"stsz");
        assert_eq!((number(sizes + 8), number(sizes + 12), number(sizes + 16)), (2, 7, 6));
        assert_eq!(file[first..], [0, 0, 0, 3, 0x65, 7, 8, 0, 0, 0, 2, 0x41, 9]);
        let keys = find(b"stss");
        assert_eq!((number(keys + 4), number(keys + 8)), (1, 1));
    }
}
