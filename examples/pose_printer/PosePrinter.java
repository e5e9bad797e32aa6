// Prints where the camera is, frame by frame, as the frontend says it. Needs nothing of this project but the message
// types; scripts/spy.sh --jar-only builds them and prints where they are:
//
//   jar=$(scripts/spy.sh --jar-only)
//   javac -cp /usr/share/java/lcm.jar:$jar -d . examples/pose_printer/PosePrinter.java
//   java -Djava.net.preferIPv4Stack=true -cp /usr/share/java/lcm.jar:$jar:. PosePrinter 'udpm://239.255.76.67:7670?ttl=0'
//
// A log is read, as fast as possible, where its name is given instead: run.lcmlog.

import dmslam.pose_t;
import java.io.EOFException;
import java.io.IOException;
import lcm.lcm.LCM;
import lcm.lcm.LCMDataInputStream;
import lcm.lcm.LCMSubscriber;
import lcm.logging.Log;

public class PosePrinter implements LCMSubscriber {
  private static final String[] STATES = {
    "no map yet", "waiting for a map", "trying a map", "tracking", "uncertain", "lost", "placed later",
    "rotation only", "too few landmarks"
  };
  private long session = 0;

  // Called by LCM for each message of the channel. Bytes that are no pose_t are refused by their fingerprint.
  @Override
  public void messageReceived(LCM lcm, String channel, LCMDataInputStream in) {
    try {
      print(new pose_t(in));
    } catch (IOException error) {
      System.err.println("PosePrinter: dropped a message on " + channel + ": " + error.getMessage());
    }
  }

  private void print(pose_t pose) {
    if (session != pose.session) {
      session = pose.session;
      System.out.printf("# session %d%n", session);
    }
    String state = pose.state < STATES.length ? STATES[pose.state] : "unknown state";
    System.out.printf("%d.%09d frame %d: ", pose.stamp_ns / 1000000000, pose.stamp_ns % 1000000000, pose.frame_index);
    if (!pose.has_pose) {
      System.out.println(state);
      return;
    }
    System.out.printf("at (%.4f, %.4f, %.4f) of map %d, %s by %d features, %.0f %% of the image moves%n", pose.x, pose.y,
        pose.z, pose.map_id, state, pose.inliers, 100 * pose.moving_share);
  }

  public static void main(String[] args) throws IOException, InterruptedException {
    String bus = args.length > 0 ? args[0] : "udpm://239.255.76.67:7670?ttl=0";
    PosePrinter printer = new PosePrinter();
    if (!bus.contains("://")) {
      Log log = new Log(bus, "r");
      try {
        for (Log.Event event = log.readNext(); ; event = log.readNext()) {
          if (!event.channel.equals("DMSLAM_FRONTEND_POSE")) continue;
          printer.messageReceived(null, event.channel, new LCMDataInputStream(event.data, 0, event.data.length));
        }
      } catch (EOFException end) {
        return;
      }
    }
    new LCM(bus).subscribe("DMSLAM_FRONTEND_POSE", printer);
    Thread.currentThread().join(); // messages come on LCM's own thread
  }
}
