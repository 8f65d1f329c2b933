// Runs a discipline of a queue of ns-3 (https://www.nsnam.org) over the packets of a file: `ns3_queues DISCIPLINE LIMIT FILE`, called by `link-table` of
// cohaptic-benches through `ns3.sh`. DISCIPLINE is tail-drop, codel, fq-codel or pie; LIMIT is the number of packets that may wait.
//
// A line of FILE is a packet: instant of its offer [ns], number of its flow, size [byte]. The first line of the output is the name of this program.
// Further lines are packets, in the order of FILE: instant at which the packet has left the line of 12 Mbit/s [ns], or -1 for a dropped packet.
//
// ns-3 is under the GNU General Public Licence, version 2. Nothing of it is copied here or shipped with this project; this file only calls it, is compiled
// by `ns3.sh` where the user has installed it, and is part of no other program. Whoever gives away a binary of it is bound by that licence.
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include <ns3/codel-queue-disc.h>
#include <ns3/core-module.h>
#include <ns3/fifo-queue-disc.h>
#include <ns3/fq-codel-queue-disc.h>
#include <ns3/network-module.h>
#include <ns3/pie-queue-disc.h>

namespace {

struct Offered {
    int64_t at;
    uint32_t flow;
    uint32_t size;
};

// A packet that knows its flow and its place in the file.
class Item : public ns3::QueueDiscItem {
  public:
    Item(const Offered& offered, std::size_t place)
        : QueueDiscItem(ns3::Create<ns3::Packet>(offered.size), ns3::Address(), 0x0800), flow(offered.flow), place(place) {}
    void AddHeader() override {}
    bool Mark() override { return false; }
    uint32_t Hash(uint32_t) const override { return flow; }

    const uint32_t flow;
    const std::size_t place;
};

// A queue, and the line after the queue.
class Line {
  public:
    Line(ns3::Ptr<ns3::QueueDisc> queue, const std::vector<Offered>& packets) : queue(queue), packets(packets), departures(packets.size(), -1) {}

    void Offer(std::size_t place) {
        queue->Enqueue(ns3::Create<Item>(packets[place], place));
        if (!busy) {
            Send();
        }
    }

    void Print() const {
        for (const int64_t departure : departures) {
            std::cout << departure << '\n';
        }
    }

  private:
    void Send() {
        const ns3::Ptr<ns3::QueueDiscItem> next = queue->Dequeue();
        busy = next != nullptr;
        if (busy) {
            const std::size_t place = ns3::DynamicCast<Item>(next)->place;
            // Eight bits a byte at 12 bits a microsecond, rounded up to a nanosecond.
            const int64_t takes = (int64_t{packets[place].size} * 8000 + 11) / 12;
            departures[place] = ns3::Simulator::Now().GetNanoSeconds() + takes;
            ns3::Simulator::Schedule(ns3::NanoSeconds(takes), &Line::Send, this);
        }
    }

    ns3::Ptr<ns3::QueueDisc> queue;
    const std::vector<Offered>& packets;
    std::vector<int64_t> departures;
    bool busy = false;
};

// The discipline with the parameters that cohaptic has by default.
ns3::Ptr<ns3::QueueDisc> Made(const std::string& name, const std::string& limit) {
    const ns3::StringValue size(limit + "p");
    if (name == "tail-drop") {
        return ns3::CreateObjectWithAttributes<ns3::FifoQueueDisc>("MaxSize", size);
    }
    // CoDel of ns-3 drops while at least so many bytes wait, CoDel of RFC 8289 while more than an MTU waits.
    if (name == "codel") {
        return ns3::CreateObjectWithAttributes<ns3::CoDelQueueDisc>("MaxSize", size, "MinBytes", ns3::UintegerValue(1500 + 1));
    }
    if (name == "fq-codel") {
        ns3::Config::SetDefault("ns3::CoDelQueueDisc::MinBytes", ns3::UintegerValue(1514 + 1));
        const auto queue = ns3::CreateObjectWithAttributes<ns3::FqCoDelQueueDisc>("MaxSize", size, "UseEcn", ns3::BooleanValue(false));
        queue->SetQuantum(1514);
        return queue;
    }
    if (name == "pie") {
        return ns3::CreateObjectWithAttributes<ns3::PieQueueDisc>("MaxSize", size, "MeanPktSize", ns3::UintegerValue(1500), "UseDerandomization",
                                                                  ns3::BooleanValue(true), "MaxBurstAllowance",
                                                                  ns3::TimeValue(ns3::MilliSeconds(150)));
    }
    std::cerr << "unknown discipline " << name << ": expected tail-drop, codel, fq-codel or pie\n";
    std::exit(2);
}

}  // namespace

int main(int count, char** arguments) {
    if (count != 4) {
        std::cerr << "expected a discipline, a number of packets and a file\n";
        return 2;
    }
    std::ifstream file(arguments[3]);
    std::vector<Offered> packets;
    for (Offered offered; file >> offered.at >> offered.flow >> offered.size;) {
        packets.push_back(offered);
    }
    if (packets.empty()) {
        std::cerr << arguments[3] << " has no packets\n";
        return 2;
    }
    const ns3::Ptr<ns3::QueueDisc> queue = Made(arguments[1], arguments[2]);
    queue->Initialize();
    Line line(queue, packets);
    for (std::size_t place = 0; place < packets.size(); ++place) {
        ns3::Simulator::Schedule(ns3::NanoSeconds(packets[place].at), &Line::Offer, &line, place);
    }
    // The timer of PIE goes off for ever. A minute is enough for all packets that wait at the end.
    ns3::Simulator::Stop(ns3::NanoSeconds(packets.back().at) + ns3::Seconds(60));
    ns3::Simulator::Run();
    std::cout << "ns-3 " NS3_VERSION << '\n';
    line.Print();
    ns3::Simulator::Destroy();
}
