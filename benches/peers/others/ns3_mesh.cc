// The mesh on ns-3 (https://www.nsnam.org): `ns3_mesh SCENE scheduler|sockets`, a file that `others-table` writes.
//
// ns-3 is under the GNU General Public Licence, version 2. Nothing of it is copied here or shipped with this project; this file only calls it, is compiled
// by `ns3.sh` where the user has installed it, and is part of no other program. Whoever gives away a binary of it is bound by that licence.
//
// `scheduler`: ns-3's events alone, one for each tick and each packet. `sockets`: a node for each peer, a point-to-point link for each pair, UDP over IPv4.
// Links of ns-3 have a constant delay; of a delay that is drawn the sender waits for what is beyond 12 ms, and does not send what is lost.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <fstream>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <ns3/core-module.h>
#include <ns3/internet-module.h>
#include <ns3/network-module.h>
#include <ns3/point-to-point-module.h>

namespace {

// Headers of UDP, IPv4 and PPP around 64 bytes take a nanosecond at this rate.
constexpr int64_t SIZE = 64, ON_THE_WIRE = SIZE + 8 + 20 + 2, SENDING = 1;
constexpr uint64_t RATE = ON_THE_WIRE * 8 * 1'000'000'000ULL;
constexpr int64_t LEAST = 12'000'000;
constexpr uint16_t PORT = 7000;

struct Motion {
    double xByV = 0, xByF = 0, vByV = 0, vByF = 0;
    void Advance(double& x, double& v, double force) const {
        const double before = v;
        x += xByV * before + xByF * force;
        v = before + (vByV * before + vByF * force);
    }
};

struct Scene {
    std::map<std::string, std::vector<double>> numbers;
    std::vector<int64_t> delays;
    int64_t peers, ticks, ticksAFrame, tickNanos, delay;
    double hand;
    Motion device, copy;
    double kc, bc, kt, bt;

    explicit Scene(const char* path) {
        std::ifstream lines(path);
        std::string line;
        while (std::getline(lines, line)) {
            std::istringstream words(line);
            std::string key, word;
            words >> key;
            while (words >> word) {
                if (key == "delays") {
                    std::ifstream file(word, std::ios::binary | std::ios::ate);
                    delays.resize(file.tellg() / sizeof(int64_t));
                    file.seekg(0);
                    file.read(reinterpret_cast<char*>(delays.data()), delays.size() * sizeof(int64_t));
                } else {
                    numbers[key].push_back(std::strtod(word.c_str(), nullptr));
                }
            }
        }
        peers = One("peers"), ticks = One("ticks"), ticksAFrame = One("ticks_a_frame"), tickNanos = One("tick_nanos"), delay = One("delay");
        hand = One("hand");
        device = Moves("device"), copy = Moves("copy");
        kc = numbers.at("coupling").at(0), bc = numbers.at("coupling").at(1);
        kt = numbers.at("gains").at(0), bt = numbers.at("gains").at(1);
    }

    double One(const char* key) const { return numbers.at(key).at(0); }
    Motion Moves(const char* key) const {
        const auto& m = numbers.at(key);
        return {m.at(0), m.at(1), m.at(2), m.at(3)};
    }

    // How long the packet takes; negative if it is lost.
    int64_t Delay(int64_t sequence, int64_t from, int64_t to) const {
        return delays.empty() ? delay : delays[(sequence * peers + from) * peers + to];
    }
};

struct Packet {
    int64_t from, sequence;
    double x, v;
};

// One participant: the arithmetic of src/mesh/body.rs, in the same order, so that it ends at the same bits.
struct Peer {
    const Scene* scene;
    int64_t me;
    double xh = 0, vh = 0, xo = 0, vo = 0, meanX = 0, meanV = 0;
    struct Held {
        double x = 0, v = 0;
        int64_t next = 0;
    };
    std::vector<Held> held;
    bool stale = false;
    uint64_t delivered = 0;

    void Receive(const Packet& packet) {
        ++delivered;
        Held& place = held[packet.from < me ? packet.from : packet.from - 1];
        if (packet.sequence >= place.next) {
            place = {packet.x, packet.v, packet.sequence + 1};
            stale = true;
        }
    }

    void Tick() {
        if (stale) {
            stale = false;
            double x[4] = {}, v[4] = {};
            for (size_t place = 0; place < held.size(); ++place) {
                x[place % 4] += held[place].x;
                v[place % 4] += held[place].v;
            }
            const double others = held.size();
            meanX = ((x[0] + x[1]) + (x[2] + x[3])) / others;
            meanV = ((v[0] + v[1]) + (v[2] + v[3])) / others;
        }
        const double coupling = scene->kc * (xh - xo) + scene->bc * (vh - vo);
        const double coordination = scene->kt * (xo - meanX) + scene->bt * (vo - meanV);
        scene->device.Advance(xh, vh, (me == 0 ? scene->hand : 0.0) - coupling);
        scene->copy.Advance(xo, vo, coupling - coordination);
    }
};

struct Mesh {
    Scene scene;
    bool sockets;
    std::vector<Peer> peers;
    std::vector<ns3::Ptr<ns3::Socket>> socket;
    std::vector<std::vector<ns3::InetSocketAddress>> address;

    Mesh(const char* path, bool sockets) : scene(path), sockets(sockets) {
        for (int64_t me = 0; me < scene.peers; ++me) {
            peers.push_back({&scene, me});
            peers.back().held.resize(scene.peers - 1);
        }
        if (sockets) Connect();
    }

    void Connect() {
        ns3::NodeContainer nodes;
        nodes.Create(scene.peers);
        ns3::Ipv4StaticRoutingHelper routing;
        ns3::InternetStackHelper internet;
        internet.SetRoutingHelper(routing);
        internet.SetIpv6StackInstall(false);
        internet.Install(nodes);
        ns3::PointToPointHelper link;
        link.SetDeviceAttribute("DataRate", ns3::DataRateValue(ns3::DataRate(RATE)));
        link.SetChannelAttribute("Delay", ns3::TimeValue(ns3::NanoSeconds((scene.delays.empty() ? scene.delay : LEAST) - SENDING)));
        ns3::Ipv4AddressHelper addresses("10.0.0.0", "255.255.255.252");
        address.assign(scene.peers, std::vector<ns3::InetSocketAddress>(scene.peers, ns3::InetSocketAddress(PORT)));
        for (int64_t a = 0; a < scene.peers; ++a) {
            for (int64_t b = a + 1; b < scene.peers; ++b) {
                const auto interfaces = addresses.Assign(link.Install(nodes.Get(a), nodes.Get(b)));
                addresses.NewNetwork();
                address[b][a] = ns3::InetSocketAddress(interfaces.GetAddress(0), PORT);
                address[a][b] = ns3::InetSocketAddress(interfaces.GetAddress(1), PORT);
            }
        }
        for (int64_t me = 0; me < scene.peers; ++me) {
            socket.push_back(ns3::Socket::CreateSocket(nodes.Get(me), ns3::UdpSocketFactory::GetTypeId()));
            socket.back()->Bind(ns3::InetSocketAddress(ns3::Ipv4Address::GetAny(), PORT));
            socket.back()->SetRecvCallback(ns3::MakeBoundCallback(+[](Mesh* mesh, int64_t me, ns3::Ptr<ns3::Socket> from) { mesh->Read(me, from); }, this, me));
        }
    }

    void Read(int64_t me, ns3::Ptr<ns3::Socket> from) {
        while (auto datagram = from->Recv()) {
            uint8_t bytes[SIZE];
            Packet packet;
            datagram->CopyData(bytes, SIZE);
            std::memcpy(&packet, bytes, sizeof packet);
            peers[me].Receive(packet);
        }
    }

    void Send(int64_t to, Packet packet) {
        uint8_t bytes[SIZE] = {};
        std::memcpy(bytes, &packet, sizeof packet);
        socket[packet.from]->SendTo(ns3::Create<ns3::Packet>(bytes, SIZE), 0, address[packet.from][to]);
    }

    void Arrive(int64_t to, Packet packet) { peers[to].Receive(packet); }

    void Tick(int64_t me, int64_t tick) {
        Peer& peer = peers[me];
        if (tick % scene.ticksAFrame == 0) {
            const Packet packet{me, tick / scene.ticksAFrame, peer.xo, peer.vo};
            for (int64_t to = 0; to < scene.peers; ++to) {
                const int64_t delay = to == me ? -1 : scene.Delay(packet.sequence, me, to);
                if (delay < 0) continue;
                if (!sockets) {
                    ns3::Simulator::Schedule(ns3::NanoSeconds(delay), &Mesh::Arrive, this, to, packet);
                } else if (scene.delays.empty()) {
                    Send(to, packet);
                } else {
                    ns3::Simulator::Schedule(ns3::NanoSeconds(delay - LEAST), &Mesh::Send, this, to, packet);
                }
            }
        }
        peer.Tick();
        if (tick + 1 < scene.ticks) ns3::Simulator::Schedule(ns3::NanoSeconds(scene.tickNanos), &Mesh::Tick, this, me, tick + 1);
    }
};

double ProcessorTime() {
    timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return now.tv_sec + now.tv_nsec / 1e9;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 3) {
        std::cerr << "ns3_mesh SCENE scheduler|sockets\n";
        return 2;
    }
    // The fastest of those that ns-3 has, on these scenes.
    ns3::Simulator::SetScheduler(ns3::ObjectFactory("ns3::PriorityQueueScheduler"));
    const bool sockets = std::strcmp(argv[2], "sockets") == 0;
    Mesh mesh(argv[1], sockets);
    for (int64_t me = 0; me < mesh.scene.peers; ++me) ns3::Simulator::Schedule(ns3::NanoSeconds(0), &Mesh::Tick, &mesh, me, int64_t{0});
    // Nodes and sockets start in events at 0; building them does not count.
    const double begin = ProcessorTime();
    // Those that arrive after the last tick do not count.
    ns3::Simulator::Stop(ns3::NanoSeconds((mesh.scene.ticks - 1) * mesh.scene.tickNanos + 1));
    ns3::Simulator::Run();
    const double seconds = ProcessorTime() - begin;
    uint64_t delivered = 0;
    for (const Peer& peer : mesh.peers) delivered += peer.delivered;
    std::printf("{\"program\": \"ns-3 %s, %s\", \"seconds\": %.9f, \"delivered\": %llu, \"positions\": [", NS3_VERSION,
                sockets ? "UDP over point-to-point links" : "events alone", seconds, static_cast<unsigned long long>(delivered));
    for (size_t place = 0; place < mesh.peers.size(); ++place) std::printf("%s%.17g", place ? ", " : "", mesh.peers[place].xo);
    std::printf("], \"lacks\": \"%s\"}\n",
                sockets ? "jitter on a link and the draws of loss (written here, at the sender); devices, coordination, stability"
                        : "links: no delay, loss, jitter, rate, queue or counter but those written here (draws are read from a file)");
    ns3::Simulator::Destroy();
    return 0;
}
