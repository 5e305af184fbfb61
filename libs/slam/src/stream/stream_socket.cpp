#include "stream/stream_socket.hpp"

#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstdint>
#include <filesystem>

#include "gelslam/core/error.hpp"

namespace gelslam::slam::detail {
namespace {

constexpr int kWaitingReaders = 16;

std::uint16_t port_of(const std::string& text) {
  int port = -1;
  const char* end = text.data() + text.size();
  const auto [stopped, failure] = std::from_chars(text.data(), end, port);
  if (failure != std::errc() || stopped != end || port < 0 || port > 65535)
    throw Error("--stream tcp:" + text + ": a port is a number from 1 to 65535 (0: any free one)");
  return static_cast<std::uint16_t>(port);
}

int bound_port(int socket) {
  sockaddr_in bound{};
  socklen_t size = sizeof bound;
  if (::getsockname(socket, reinterpret_cast<sockaddr*>(&bound), &size) != 0) return 0;
  return ntohs(bound.sin_port);
}

Listener listen_at_tcp(const std::string& port_text) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port_of(port_text));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  FileDescriptor socket(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const int yes = 1;
  ::setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  if (::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::listen(socket.get(), kWaitingReaders) != 0) {
    if (errno == EADDRINUSE)
      throw Error("port " + port_text + " is in use by another program; choose another one");
    throw Error("cannot stream to port " + port_text + ": " + errno_text());
  }
  std::string name = "tcp:127.0.0.1:" + std::to_string(bound_port(socket.get()));
  return {std::move(socket), std::move(name), ""};
}

/// A socket file stays behind when its program is killed. Anything else is not ours to remove.
void remove_abandoned_socket(const std::string& path, const sockaddr_un& address) {
  struct stat status {};
  if (::lstat(path.c_str(), &status) != 0) return;
  if (!S_ISSOCK(status.st_mode))
    throw Error("--stream unix:" + path + ": there is a file of that name; choose another one");
  const FileDescriptor probe(::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (::connect(probe.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ||
      errno != ECONNREFUSED)
    throw Error(path + " is in use by another program; choose another one");
  ::unlink(path.c_str());
}

Listener listen_at_path(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path)
    throw Error("--stream unix:" + path + ": a socket's path has 1 to " +
                std::to_string(sizeof address.sun_path - 1) + " characters");
  path.copy(address.sun_path, path.size());
  remove_abandoned_socket(path, address);
  FileDescriptor socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::listen(socket.get(), kWaitingReaders) != 0)
    throw Error("cannot make the socket " + path + ": " + errno_text());
  return {std::move(socket), "unix:" + path, std::filesystem::absolute(path).string()};
}

}  // namespace

Listener listen_at(const std::string& target) {
  if (target.starts_with("tcp:")) return listen_at_tcp(target.substr(4));
  if (target.starts_with("unix:")) return listen_at_path(target.substr(5));
  throw Error("--stream " + target + ": should be -, unix:PATH or tcp:PORT");
}

}  // namespace gelslam::slam::detail
