#include "tests/tls/tls_pair.h"

#include <arpa/inet.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <ctime>
#include <thread>

#include "common/base/check.h"
#include "common/base/files.h"
#include "common/wire/limits.h"

namespace kiln::test {
namespace fs = std::filesystem;
namespace {

std::string slurp(const fs::path& path) {
  const Bytes bytes = *read_file(path);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// As `openssl x509 -req` would, without anything of a farm.
std::string sign_for_another_use(const std::string& request, const KeyAndCertificate& authority, int64_t from,
                                 int64_t to) {
  const auto bio = [](const std::string& pem) {
    return BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size()));
  };
  BIO *req_bio = bio(request), *ca_bio = bio(authority.certificate), *key_bio = bio(authority.key);
  X509_REQ* req = PEM_read_bio_X509_REQ(req_bio, nullptr, nullptr, nullptr);
  X509* ca = PEM_read_bio_X509(ca_bio, nullptr, nullptr, nullptr);
  EVP_PKEY* key = PEM_read_bio_PrivateKey(key_bio, nullptr, nullptr, nullptr);
  X509* x = X509_new();
  X509_set_version(x, X509_VERSION_3);
  ASN1_INTEGER_set(X509_get_serialNumber(x), 77);
  X509_set_subject_name(x, X509_REQ_get_subject_name(req));
  X509_set_issuer_name(x, X509_get_subject_name(ca));
  X509_set_pubkey(x, X509_REQ_get0_pubkey(req));
  ASN1_TIME_set(X509_getm_notBefore(x), now() + from);
  ASN1_TIME_set(X509_getm_notAfter(x), now() + to);
  X509_EXTENSION* names = X509V3_EXT_conf_nid(nullptr, nullptr, NID_subject_alt_name, "IP:127.0.0.1");
  X509_add_ext(x, names, -1);
  KILN_CHECK(X509_sign(x, key, EVP_sha256()) != 0);
  BIO* out = BIO_new(BIO_s_mem());
  PEM_write_bio_X509(out, x);
  char* data = nullptr;
  const long size = BIO_get_mem_data(out, &data);
  std::string pem(data, static_cast<size_t>(size));
  X509_EXTENSION_free(names);
  X509_free(x);
  X509_free(ca);
  X509_REQ_free(req);
  EVP_PKEY_free(key);
  for (BIO* b : {req_bio, ca_bio, key_bio, out}) BIO_free(b);
  return pem;
}

}  // namespace

int64_t now() {
  return std::time(nullptr);
}

Farm::Farm() {
  KILN_CHECK(make_authority_folder(ca_dir(), "farm-ca", 100, now() - 50 * kDay).has_value());
  authority_ = {slurp(ca_dir() / "ca.key"), slurp(ca_dir() / "ca.pem")};
}

TlsFiles Farm::files(const std::string& name, std::vector<Role> roles, int64_t from, int64_t to) {
  const auto own = make_key_and_request(name);
  const bool server = std::count(roles.begin(), roles.end(), Role::kCoordinator) != 0;
  const auto certificate =
      roles.empty()
          ? sign_for_another_use(own->request, authority_, from, to)
          : sign_request(own->request, authority_,
                         {name, roles, server ? hosts : std::vector<std::string>(), now() + from, now() + to})
                .value();
  static int made = 0;
  const fs::path folder = path() / (name + std::to_string(made++));
  fs::create_directories(folder);
  KILN_CHECK(write_private_file(folder / "cert.pem", certificate).has_value());
  KILN_CHECK(write_private_file(folder / "key.pem", own->key).has_value());
  return {ca_dir() / "ca.pem", folder / "cert.pem", folder / "key.pem"};
}

std::shared_ptr<const TlsContext> Farm::context(const std::string& name, std::vector<Role> roles,
                                                int64_t from, int64_t to) {
  const auto loaded = TlsContext::load(files(name, std::move(roles), from, to), now() + (from + to) / 2);
  EXPECT_TRUE(loaded) << (loaded ? "" : loaded.error().message);
  return *loaded;
}

TlsPair::TlsPair(ListenOptions options) {
  if (!options.on_refused)
    options.on_refused = [this](const std::string&, const std::string& reason) { refused = reason; };
  auto opened = Listener::open(
      loop, "127.0.0.1", 0,
      [this](std::unique_ptr<Connection> c) {
        ++accepted;
        server = std::move(c);
        start(*server, at_server, server_closed);
      },
      std::move(options));
  KILN_CHECK(opened.has_value());
  listener = std::move(*opened);
  limit.after(std::chrono::seconds(30), [this] { late = true; });
}

void TlsPair::start(Connection& connection, std::deque<Message>& messages, std::string& closed) {
  Connection::Handlers h;
  h.on_frame = [&messages](const FrameHeader& header, auto payload) {
    messages.push_back(*decode(header, payload));
  };
  h.on_closed = [&closed](const std::string& reason) { closed = reason; };
  connection.accept_data();
  connection.start(std::move(h), kChunkWriteBudget);
}

void TlsPair::connect(std::shared_ptr<const TlsContext> tls, const std::string& host) {
  connect_to(
      loop, host, listener->port(), std::chrono::seconds(20),
      [this](Expected<std::unique_ptr<Connection>> c) {
        if (!c) {
          client_failed = c.error().message;
          return;
        }
        client = std::move(*c);
        start(*client, at_client, client_closed);
      },
      std::move(tls));
}

void TlsPair::run(const std::function<bool()>& done) {
  loop.run_until([&] { return late || done(); });
  ASSERT_FALSE(late);
}

void TlsPair::open() {
  run([this] { return (server && client) || !refused.empty() || !client_failed.empty(); });
  ASSERT_EQ(refused + client_failed, "");
}

std::string TlsPair::client_words() {
  run([this] { return !client_failed.empty() || !client_closed.empty(); });
  return client_failed + client_closed;
}

std::string TlsPair::server_words() {
  run([this] { return !refused.empty() || !server_closed.empty(); });
  return refused + server_closed;
}

int raw_connect(uint16_t port) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  KILN_CHECK(::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0);
  return fd;
}

std::string raw_read(TlsPair& pair, int fd) {
  std::string all;
  bool open = true;
  Timer poll(pair.loop);
  std::function<void()> look = [&] {
    char buffer[4096];
    const ssize_t got = ::recv(fd, buffer, sizeof buffer, MSG_DONTWAIT);
    if (got > 0) all.append(buffer, static_cast<size_t>(got));
    if (got == 0 || (got < 0 && errno != EAGAIN)) open = false;
    if (open) poll.after(std::chrono::milliseconds(1), look);
  };
  look();
  pair.run([&] { return !open; });
  return all;
}

void connect_with_tls12(uint16_t port) {
  SSL_CTX* context = SSL_CTX_new(TLS_client_method());
  SSL_CTX_set_max_proto_version(context, TLS1_2_VERSION);
  SSL* ssl = SSL_new(context);
  const int fd = raw_connect(port);
  SSL_set_fd(ssl, fd);
  EXPECT_NE(SSL_connect(ssl), 1);
  SSL_free(ssl);
  SSL_CTX_free(context);
  ::close(fd);
}

struct RawServer::Impl {
  int listener = -1;
  std::thread thread;
};

RawServer::RawServer(const TlsFiles& files) : impl_(std::make_unique<Impl>()) {
  impl_->listener = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  KILN_CHECK(::bind(impl_->listener, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0);
  KILN_CHECK(::listen(impl_->listener, 1) == 0);
  impl_->thread = std::thread([fd = impl_->listener, files] {
    const int peer = ::accept(fd, nullptr, nullptr);
    if (peer < 0) return;
    SSL_CTX* context = SSL_CTX_new(TLS_server_method());
    SSL_CTX_use_certificate_file(context, files.certificate.c_str(), SSL_FILETYPE_PEM);
    SSL_CTX_use_PrivateKey_file(context, files.key.c_str(), SSL_FILETYPE_PEM);
    SSL* ssl = SSL_new(context);
    SSL_set_fd(ssl, peer);
    SSL_accept(ssl);
    char byte;
    while (SSL_read(ssl, &byte, 1) > 0) {
    }
    SSL_free(ssl);
    SSL_CTX_free(context);
    ::close(peer);
  });
}

RawServer::~RawServer() {
  ::shutdown(impl_->listener, SHUT_RDWR);
  impl_->thread.join();
  ::close(impl_->listener);
}

uint16_t RawServer::port() const {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  ::getsockname(impl_->listener, reinterpret_cast<sockaddr*>(&address), &size);
  return ntohs(address.sin_port);
}

}  // namespace kiln::test
