//! The tests of what the crate promises, in one program: it is linked once.

mod c_header;
mod mock_up;
