// Opens a camera as the program does, reads and decodes frames, and says what came, for
// tests/v4l2/guest/*.sh:
//   camera_probe DEVICE MJPG|YUYV WIDTH HEIGHT RATE_HZ FRAMES
// Exit code 2 and one line on stderr when the camera cannot be opened or is lost.
#include <iostream>
#include <opencv2/core.hpp>

#include "gelslam/core/error.hpp"
#include "gelslam/sensor/camera.hpp"
#include "gelslam/sensor/frame_source.hpp"

namespace {

void probe(const gelslam::SensorProfile& profile, int frames) {
  const auto camera = gelslam::open_camera(gelslam::camera_options(profile));
  std::cout << "camera: " << camera->description() << "\n";
  for (const gelslam::CameraSetting& setting : camera->settings())
    std::cout << "setting: " << setting.name << "=" << setting.value << (setting.locked ? "" : " automatic")
              << "\n";
  gelslam::FrameDecoder decoder(profile);
  int decoded = 0;
  double last_s = -1, mean = 0;
  bool forward = true;
  for (int i = 0; i < frames; ++i) {
    const auto frame = camera->next();
    forward = forward && frame->time_s > last_s;
    last_s = frame->time_s;
    std::cout << "frame " << i << " of " << frame->bytes.size() << " bytes"
              << std::endl;  // a test waits for this line
    const auto picture = decoder.decode(*frame);
    if (!picture) {
      std::cout << "damage: " << decoder.damage() << "\n";
      continue;
    }
    ++decoded;
    mean = cv::mean(picture->bgr)[1];
  }
  std::cout << "decoded: " << decoded << "\nlost: " << camera->lost_frames()
            << "\ntimes: " << (forward ? "forward" : "backward") << "\ngreen: " << cvRound(mean)
            << "\nwarning: " << camera->warning() << "\n";
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 7) return 3;
  gelslam::SensorProfile profile;
  profile.camera = argv[1];
  profile.camera_format = argv[2];
  profile.raw_width_px = std::stoi(argv[3]);
  profile.raw_height_px = std::stoi(argv[4]);
  profile.frame_rate_hz = std::stod(argv[5]);
  try {
    probe(profile, std::stoi(argv[6]));
  } catch (const gelslam::Error& error) {
    std::cerr << "error: " << error.what() << std::endl;
    return 2;
  }
}
