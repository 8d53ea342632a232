pub(crate) mod binning;
pub(crate) mod sample_buffer;
