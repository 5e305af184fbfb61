// Makes a virtual camera do what a test wants; used inside QEMU by tests/v4l2/guest/*.sh.
//   virtual_camera feed RATE_HZ LOG DEVICE FOLDER FRAMES
//       writes FOLDER/*.jpg in turn to a v4l2loopback device; unless LOG is "", each again until this file
//       has grown
//   virtual_camera control DEVICE TITLE VALUE
//       sets a control by its title (vivid injects faults by controls)
#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

namespace {

std::system_error failure(const std::string& doing) {
  return std::system_error(errno, std::generic_category(), doing);
}

int open_device(const std::string& path) {
  const int fd = ::open(path.c_str(), O_RDWR);
  if (fd < 0) throw failure("open " + path);
  return fd;
}

std::vector<char> read_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Width and height as the JPEG's frame header (SOF0 or SOF2) has them.
std::pair<unsigned, unsigned> size_of(const std::vector<char>& jpeg) {
  const auto byte = [&](std::size_t at) {
    return static_cast<unsigned>(static_cast<unsigned char>(jpeg.at(at)));
  };
  for (std::size_t at = 2; at + 9 < jpeg.size(); at += 2 + (byte(at + 2) << 8 | byte(at + 3))) {
    if (byte(at + 1) == 0xc0 || byte(at + 1) == 0xc2)
      return {byte(at + 7) << 8 | byte(at + 8), byte(at + 5) << 8 | byte(at + 6)};
  }
  throw std::runtime_error("no JPEG");
}

std::uintmax_t size_or_0(const std::filesystem::path& path) {
  std::error_code missing;
  const std::uintmax_t bytes = std::filesystem::file_size(path, missing);
  return missing ? 0 : bytes;
}

std::vector<std::vector<char>> read_pictures(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<std::vector<char>> pictures;
  for (const auto& file : files) pictures.push_back(read_file(file));
  return pictures;
}

/// Open to the end of the program.
int open_loopback(const std::string& device, const std::vector<char>& first_picture) {
  const int fd = open_device(device);
  const auto [width, height] = size_of(first_picture);
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  format.fmt.pix.width = width;
  format.fmt.pix.height = height;
  format.fmt.pix.pixelformat = V4L2_PIX_FMT_MJPEG;
  format.fmt.pix.sizeimage = width * height;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  if (::ioctl(fd, VIDIOC_S_FMT, &format) != 0) throw failure("set the format");
  return fd;
}

void feed(double rate_hz, const std::filesystem::path& log, const std::string& device,
          const std::filesystem::path& folder, std::uintmax_t frames) {
  const std::vector<std::vector<char>> pictures = read_pictures(folder);
  const int fd = open_loopback(device, pictures.at(0));
  std::cout << "feeding" << std::endl;  // a test waits for this line
  auto due = std::chrono::steady_clock::now();
  const auto most_again = static_cast<std::uintmax_t>(120 * rate_hz);
  std::uintmax_t i = 0, logged = 0, shown_again = 0;
  while (i < frames) {
    const std::vector<char>& picture = pictures[i % pictures.size()];
    const std::uintmax_t bytes = size_or_0(log);
    if (log.empty() || bytes > logged) {
      ++i;
      shown_again = 0;
    } else if (++shown_again > most_again) {
      throw std::runtime_error(log.string() + " does not grow");
    }
    logged = bytes;
    if (::write(fd, picture.data(), picture.size()) < 0) throw failure("write a frame");
    due += std::chrono::microseconds(static_cast<long>(1e6 / rate_hz));
    std::this_thread::sleep_until(due);
  }
}

void set_control(const std::string& device, const std::string& title, int value) {
  const int fd = open_device(device);
  v4l2_queryctrl query{};
  for (;;) {
    query.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
    if (::ioctl(fd, VIDIOC_QUERYCTRL, &query) != 0) throw std::runtime_error("no control " + title);
    if (title == reinterpret_cast<const char*>(query.name)) break;
  }
  v4l2_control control{query.id, value};
  if (::ioctl(fd, VIDIOC_S_CTRL, &control) != 0) throw failure("set " + title);
  ::close(fd);
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  try {
    if (arguments.size() == 6 && arguments[0] == "feed") {
      feed(std::stod(arguments[1]), arguments[2], arguments[3], arguments[4], std::stoul(arguments[5]));
    } else if (arguments.size() == 4 && arguments[0] == "control") {
      set_control(arguments[1], arguments[2], std::stoi(arguments[3]));
    } else {
      throw std::runtime_error("usage: see the head of the source");
    }
  } catch (const std::exception& error) {
    std::cerr << "virtual_camera: " << error.what() << std::endl;
    return 1;
  }
}
