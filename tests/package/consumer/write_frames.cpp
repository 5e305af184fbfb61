// Writes the frames of a log as PNG. Usage: write_frames LOG FOLDER
#include <gelslam/sensor/frame_source.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>

int main(int, char** argv) {
  const auto source = gelslam::open_frame_source(argv[1], {});
  while (const auto frame = source->next())
    cv::imwrite(std::string(argv[2]) + "/" + std::to_string(frame->index) + ".png", frame->bgr);
}
