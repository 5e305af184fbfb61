#include "stream/stream_socket.hpp"

#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <filesystem>
#include <memory>

#include "gelslam/core/error.hpp"

namespace gelslam::slam::detail {
namespace {

constexpr int kWaitingReaders = 16;

int port_of(const std::string& text) {
  int port = -1;
  const char* end = text.data() + text.size();
  const auto [stopped, failure] = std::from_chars(text.data(), end, port);
  if (failure != std::errc() || stopped != end || port < 0 || port > 65535)
    throw Error("--stream tcp:" + text + ": a port is a number from 1 to 65535 (0: any free one)");
  return port;
}

int bound_port(int socket) {
  sockaddr_storage bound{};
  socklen_t size = sizeof bound;
  if (::getsockname(socket, reinterpret_cast<sockaddr*>(&bound), &size) != 0) return 0;
  return ntohs(bound.ss_family == AF_INET6 ? reinterpret_cast<const sockaddr_in6&>(bound).sin6_port
                                           : reinterpret_cast<const sockaddr_in&>(bound).sin_port);
}

Listener listen_at_tcp(const std::string& port_text, const std::string& address) {
  const int port = port_of(port_text);
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV | AI_PASSIVE;
  addrinfo* found = nullptr;
  if (::getaddrinfo(address.c_str(), std::to_string(port).c_str(), &hints, &found) != 0)
    throw Error("--listen " + address + " is no address; use 127.0.0.1, 0.0.0.0 or one of this machine");
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owned(found, &::freeaddrinfo);
  FileDescriptor socket(::socket(found->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const int yes = 1;
  ::setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  if (::bind(socket.get(), found->ai_addr, found->ai_addrlen) != 0 ||
      ::listen(socket.get(), kWaitingReaders) != 0) {
    if (errno == EADDRINUSE)
      throw Error("port " + port_text + " is in use by another program; choose another one");
    throw Error("cannot stream to port " + port_text + " of " + address + ": " + errno_text());
  }
  const bool is_ipv6 = found->ai_family == AF_INET6;
  const std::string host = is_ipv6 ? "[" + address + "]" : address;
  std::string name = "tcp:" + host + ":" + std::to_string(bound_port(socket.get()));
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

Listener listen_at(const std::string& target, const std::string& address) {
  if (target.starts_with("tcp:")) return listen_at_tcp(target.substr(4), address);
  if (target.starts_with("unix:")) return listen_at_path(target.substr(5));
  throw Error("--stream " + target + ": should be -, unix:PATH or tcp:PORT");
}

}  // namespace gelslam::slam::detail
